// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/authored_prim.h"

#include <pxr/base/tf/diagnostic.h>

#include <cstring>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::Path;
using usd::layer::Token;
using usd::layer::Value;

namespace {

void check(const Result<void>& result) {
    if (!result) TF_WARN("velatura: %s", result.error().message.c_str());
}

}  // namespace

void AuthoredPrim::set(std::string name, const VtValue& value, const TfToken& role) {
    if (value.IsEmpty()) return;
    if (std::optional<TypedValue> typed = to_value(value, role))
        set(std::move(name), std::move(typed->type), std::move(typed->value));
    else
        TF_WARN("velatura: %s has the type %s, which no attribute can have; it is skipped",
                name.c_str(), value.GetTypeName().c_str());
}

void AuthoredPrim::set(std::string name, std::string type, Value value) {
    attributes_.push_back({std::move(name), std::move(type), std::move(value)});
}

void AuthoredPrim::set_token(std::string name, std::string_view value) {
    set(std::move(name), "token", Value(Token(value)));
}

void AuthoredPrim::set_interpolated(const std::string& name,
                                    TypedValue value,
                                    std::string_view interpolation,
                                    const std::vector<int32_t>& indices) {
    set(name, std::move(value.type), std::move(value.value));
    add_metadata(name, "interpolation", Value(Token(interpolation)));
    if (!indices.empty()) set(name + ":indices", "int[]", Value::array(indices));
}

void AuthoredPrim::set_transform(const GfMatrix4d& matrix, bool resets) {
    usd::layer::Mat4d own;
    std::memcpy(static_cast<void*>(&own), matrix.GetArray(), sizeof own);
    set("xformOp:transform", "matrix4d", Value(own));
    std::vector<Token> order = {Token("xformOp:transform")};
    if (resets) order.insert(order.begin(), Token("!resetXformStack!"));
    set("xformOpOrder", "token[]", Value::array(std::move(order)));
}

void AuthoredPrim::connect(std::string name, std::string type, Path source) {
    connections_.push_back({std::move(name), std::move(type), source});
}

void AuthoredPrim::target(std::string name, std::vector<Path> targets) {
    targets_.emplace_back(std::move(name), std::move(targets));
}

void AuthoredPrim::add_metadata(std::string property, std::string key, Value value) {
    metadata_.push_back({std::move(property), std::move(key), std::move(value)});
}

AuthoredPrim& AuthoredPrim::add_child(std::string name, std::string type) {
    return children_.emplace_back(std::move(name), AuthoredPrim(std::move(type))).second;
}

void AuthoredPrim::author(usd::layer::LayerBuilder& builder, Path path) const {
    check(builder.define(path, type_));
    for (const std::string& schema : schemas_) check(builder.apply_schema(path, schema));
    for (const Attribute& a : attributes_)
        check(builder.set(path.append_property(a.name), a.type, a.value));
    for (const Connection& c : connections_)
        check(builder.connect(path.append_property(c.name), c.type, {c.source}));
    for (const auto& [name, targets] : targets_)
        check(builder.set_targets(path.append_property(name), targets));
    for (const Metadata& m : metadata_)
        check(builder.set_metadata(m.property.empty() ? path : path.append_property(m.property),
                                   m.key, m.value));
    for (const auto& [name, child] : children_) child.author(builder, path.append_child(name));
}

}  // namespace velatura::hydra
