// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/layer_builder.h"

#include "usd/layer/fields.h"
#include "usd/layer/type_name.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::layer {

namespace {

Error failure(Path path, const std::string& message) {
    return {"usd-author", fmt::format("<{}>: {}", path.to_string(), message)};
}

bool is_plain_prim(Path path) {
    return path.is_absolute() && path.is_prim() && !path.has_variant_selection();
}

bool is_plain_property(Path path) {
    return path.kind() == PathKind::Property && is_plain_prim(path.parent());
}

bool has_type(const Value& value, const TypeInfo& type) {
    if (value.is_block()) return true;
    return value.type() == type.type && value.is_array() == type.is_array;
}

void erase_field(Spec& spec, Token name) {
    std::vector<Field> kept(spec.fields().begin(), spec.fields().end());
    std::erase_if(kept, [&](const Field& f) { return f.name == name; });
    spec.set_fields(std::move(kept));
}

}  // namespace

LayerBuilder::LayerBuilder(std::string identifier) : identifier_(std::move(identifier)) {
    objects_[Path::absolute_root()].spec = Spec(SpecKind::PseudoRoot, {});
}

std::shared_ptr<Layer> LayerBuilder::layer() const {
    auto layer = std::make_shared<Layer>(identifier_);
    layer->reserve(objects_.size());
    std::vector<Path> pending = {Path::absolute_root()};
    while (!pending.empty()) {
        const Path path = pending.back();
        pending.pop_back();
        const Object& object = objects_.at(path);
        const std::span<const Field> authored = object.spec.fields();
        layer->create_spec(path, object.spec.kind(), {})
            .set_fields(std::vector<Field>(authored.begin(), authored.end()));
        pending.insert(pending.end(), object.children.rbegin(), object.children.rend());
    }
    return layer;
}

Spec* LayerBuilder::find(Path path) {
    const auto known = objects_.find(path);
    return known == objects_.end() ? nullptr : &known->second.spec;
}

/// The parent is there; the object may be.
Spec& LayerBuilder::add(Path path, SpecKind kind) {
    const auto [place, is_new] = objects_.try_emplace(path);
    if (is_new) {
        place->second.spec = Spec(kind, {});
        objects_.at(path.parent()).children.push_back(path);
    }
    return place->second.spec;
}

bool LayerBuilder::remove(Path object) {
    if (object.is_absolute_root() || !has(object)) return false;
    std::erase(objects_.at(object.parent()).children, object);
    std::vector<Path> pending = {object};
    while (!pending.empty()) {
        const auto removed = objects_.extract(pending.back());
        pending.pop_back();
        const std::vector<Path>& children = removed.mapped().children;
        pending.insert(pending.end(), children.begin(), children.end());
    }
    return true;
}

Result<void> LayerBuilder::define(Path prim, std::string_view type, Specifier specifier) {
    if (!is_plain_prim(prim)) return failure(prim, "not the absolute path of a prim");
    for (const Path& prefix : prim.prefixes()) {
        if (has(prefix)) continue;
        add(prefix, SpecKind::Prim).set_field(fields().specifier, Value(Specifier::Def), {});
    }
    Spec& spec = *find(prim);
    spec.set_field(fields().specifier, Value(specifier), {});
    erase_field(spec, fields().type_name);
    if (!type.empty()) spec.set_field(fields().type_name, Value(Token(type)), {});
    return {};
}

Result<Spec*> LayerBuilder::prim_spec(Path prim) {
    Spec* const spec = is_plain_prim(prim) ? find(prim) : nullptr;
    if (!spec) return failure(prim, "no such prim; define() comes first");
    return spec;
}

/// The spec of an attribute that can have the values.
Result<Spec*> LayerBuilder::attribute_spec(Path attribute,
                                           std::string_view type,
                                           const std::vector<const Value*>& values) {
    if (!is_plain_property(attribute)) return failure(attribute, "not the path of an attribute");
    if (const Result<Spec*> prim = prim_spec(attribute.parent()); !prim) return prim.error();
    const TypeInfo* const info = find_type(type);
    if (!info) return failure(attribute, fmt::format("unknown type {}", type));
    for (const Value* const value : values) {
        if (!has_type(*value, *info))
            return failure(attribute,
                           fmt::format("expected a value of type {}, got {}", type,
                                       value->is_empty() ? "none" : plain_type_name(*value)));
    }
    if (const Spec* const known = find(attribute); known && known->kind() != SpecKind::Attribute)
        return failure(attribute, "is a relationship");
    Spec& spec = add(attribute, SpecKind::Attribute);
    spec.set_field(fields().type_name, Value(info->name), {});
    return &spec;
}

Result<void> LayerBuilder::set(Path attribute, std::string_view type, Value value) {
    const Result<Spec*> spec = attribute_spec(attribute, type, {&value});
    if (!spec) return spec.error();
    (*spec)->set_field(fields().default_value, std::move(value), {});
    return {};
}

Result<void> LayerBuilder::set_samples(Path attribute,
                                       std::string_view type,
                                       std::vector<std::pair<double, Value>> samples) {
    std::vector<const Value*> values;
    for (const auto& [time, value] : samples) values.push_back(&value);
    const Result<Spec*> spec = attribute_spec(attribute, type, values);
    if (!spec) return spec.error();
    if (samples.empty()) {
        erase_field(**spec, fields().time_samples);
        return {};
    }
    (*spec)->set_field(fields().time_samples, Value(TimeSamples(std::move(samples))), {});
    return {};
}

Result<void> LayerBuilder::connect(Path attribute,
                                   std::string_view type,
                                   std::vector<Path> sources) {
    if (!std::all_of(sources.begin(), sources.end(), is_plain_property))
        return failure(attribute, "a connection leads to an attribute");
    const Result<Spec*> spec = attribute_spec(attribute, type, {});
    if (!spec) return spec.error();
    (*spec)->set_field(fields().connection_paths,
                       Value(PathListOp::make_explicit(std::move(sources))), {});
    return {};
}

Result<void> LayerBuilder::set_targets(Path relationship, std::vector<Path> targets) {
    if (!is_plain_property(relationship))
        return failure(relationship, "not the path of a relationship");
    if (const Result<Spec*> prim = prim_spec(relationship.parent()); !prim) return prim.error();
    for (const Path& target : targets)
        if (!target.is_absolute())
            return failure(relationship, "a target must be an absolute path");
    if (const Spec* const known = find(relationship);
        known && known->kind() != SpecKind::Relationship)
        return failure(relationship, "is an attribute");
    add(relationship, SpecKind::Relationship)
        .set_field(fields().target_paths, Value(PathListOp::make_explicit(std::move(targets))), {});
    return {};
}

Result<void> LayerBuilder::apply_schema(Path prim, std::string_view schema) {
    const Result<Spec*> spec = prim_spec(prim);
    if (!spec) return spec.error();
    const Token field = fields().api_schemas;
    TokenListOp op;
    if (const auto* const known = (*spec)->field_as<TokenListOp>(field)) op = *known;
    if (std::find(op.prepended.begin(), op.prepended.end(), schema) != op.prepended.end())
        return {};
    op.prepended.push_back(Token(schema));
    (*spec)->set_field(field, Value(std::move(op)), {});
    return {};
}

Result<void> LayerBuilder::set_reference(Path prim, Path referenced) {
    if (!is_plain_prim(referenced)) return failure(referenced, "not the absolute path of a prim");
    const Result<Spec*> spec = prim_spec(prim);
    if (!spec) return spec.error();
    Reference reference;
    reference.prim_path = referenced;
    (*spec)->set_field(fields().references,
                       Value(ReferenceListOp::make_explicit({std::move(reference)})), {});
    return {};
}

Result<void> LayerBuilder::set_metadata(Path object, std::string_view key, Value value) {
    Spec* const spec = find(object);
    if (!spec) return failure(object, "no such prim or property");
    if (key.empty() || value.is_empty()) return failure(object, "metadata needs a key and a value");
    spec->set_field(Token(key), std::move(value), {});
    return {};
}

}  // namespace velatura::usd::layer
