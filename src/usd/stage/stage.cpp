// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/stage.h"

#include "usd/layer/fields.h"
#include "usd/stage/prim_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

namespace {

double number_or(const Value* value, double otherwise) {
    if (!value) return otherwise;
    if (const auto* d = value->get_if<double>()) return *d;
    if (const auto* f = value->get_if<float>()) return double(*f);
    if (const auto* i = value->get_if<int32_t>()) return double(*i);
    if (const auto* i = value->get_if<int64_t>()) return double(*i);
    return otherwise;
}

}  // namespace

Stage::Stage(std::shared_ptr<StageImpl> impl) : impl_(std::move(impl)) {}

Result<Stage> Stage::open(const std::string& path,
                          const StageOptions& options,
                          Diagnostics& diagnostics) {
    auto impl = std::make_shared<StageImpl>(options, diagnostics);
    const Result<bool> opened = impl->open(path);
    if (!opened) return opened.error();
    return Stage(std::move(impl));
}

Prim Stage::pseudo_root() const {
    return Prim(&impl_->root());
}

Prim Stage::prim_at(const Path& path) const {
    return Prim(impl_->find(path));
}

Prim Stage::prim_at(std::string_view path) const {
    return Prim(impl_->find(Path::from(path)));
}

Prim Stage::default_prim() const {
    const Path path = impl_->root_layers().back()->default_prim();
    return path.is_empty() ? Prim() : prim_at(path);
}

std::vector<Prim> Stage::prototypes() const {
    std::vector<Prim> result;
    for (const PrimData* data : impl_->prototypes()) result.emplace_back(data);
    return result;
}

size_t Stage::prim_count() const {
    return impl_->prim_count();
}

std::optional<Value> Stage::metadata(std::string_view key) const {
    std::vector<const layer::Spec*> specs;
    for (const layer::Layer* layer : impl_->root_layers()) specs.push_back(&layer->pseudo_root());
    return compose_field(specs, Token(key));
}

std::vector<std::string> Stage::metadata_keys() const {
    std::set<std::string> keys;
    for (const layer::Layer* layer : impl_->root_layers()) {
        for (const layer::Field& field : layer->pseudo_root().fields()) {
            if (!is_composition_field(field.name)) keys.insert(field.name.str());
        }
    }
    return {keys.begin(), keys.end()};
}

std::string Stage::up_axis() const {
    const Value* value = impl_->root_field(layer::fields().up_axis);
    const Token* axis = value ? value->get_if<Token>() : nullptr;
    if (!axis) return "Y";
    if (*axis == "Y" || *axis == "Z") return axis->str();
    impl_->diagnostics().warn(
        "usd-bad-up-axis", {}, "/",
        fmt::format("upAxis is \"{}\", expected Y or Z; Y is used", axis->str()));
    return "Y";
}

double Stage::meters_per_unit() const {
    return number_or(impl_->root_field(layer::fields().meters_per_unit), 0.01);
}

double Stage::time_codes_per_second() const {
    return impl_->composer().root_stack()->time_codes_per_second();
}

double Stage::frames_per_second() const {
    return number_or(impl_->root_field(layer::fields().frames_per_second), 24.0);
}

double Stage::start_time_code() const {
    return number_or(impl_->root_field(layer::fields().start_time_code), 0.0);
}

double Stage::end_time_code() const {
    return number_or(impl_->root_field(layer::fields().end_time_code), 0.0);
}

bool Stage::has_time_code_range() const {
    const auto& layers = impl_->root_layers();
    return std::any_of(layers.begin(), layers.end(), [](const layer::Layer* layer) {
        return layer->pseudo_root().has_field(layer::fields().start_time_code) &&
               layer->pseudo_root().has_field(layer::fields().end_time_code);
    });
}

std::string Stage::root_file() const {
    return impl_->composer().root_stack()->identifier();
}

std::vector<std::string> Stage::layer_files() const {
    return impl_->composer().registry().opened();
}

std::string Stage::package_root_layer(const std::string& package) const {
    const Result<compose::LayerPtr> root = impl_->composer().registry().open(package);
    return root ? (*root)->identifier() : std::string();
}

Diagnostics& Stage::diagnostics() const {
    return impl_->diagnostics();
}

std::vector<compose::CompositionError> Stage::composition_errors() const {
    const compose::Composer& composer = impl_->composer();
    return composer.errors().all();
}

void traverse(Prim root, const std::function<bool(Prim)>& visit) {
    std::vector<Prim> open = {root};
    while (!open.empty()) {
        const Prim prim = open.back();
        open.pop_back();
        if (!prim || !visit(prim)) continue;
        const std::vector<Prim> children = prim.children();
        open.insert(open.end(), children.rbegin(), children.rend());
    }
}

}  // namespace velatura::usd::stage
