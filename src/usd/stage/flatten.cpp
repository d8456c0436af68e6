// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/flatten.h"

#include "usd/compose/layer_registry.h"
#include "usd/layer/fields.h"
#include "usd/layer/spline.h"
#include "usd/layer/type_name.h"
#include "usd/stage/asset_expression.h"
#include "usd/stage/path_expression.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/resolve.h"
#include "usd/stage/value_cast.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

namespace velatura::usd::stage {

using layer::Path;
using layer::SpecKind;
using layer::Token;
using layer::Value;

namespace {

namespace fs = std::filesystem;

/// Makes asset paths mean the same files from anywhere.
class AssetAnchorer {
  public:
    AssetAnchorer(StageImpl& stage, std::string folder)
        : stage_(stage), folder_(std::move(folder)) {}

    std::string anchored(const std::string& authored,
                         const AssetAnchor& anchor,
                         const std::string& prim,
                         SourceLoc loc) const {
        const std::string path = evaluate_asset(authored, anchor, prim, loc, stage_.diagnostics());
        if (path.empty()) return authored;
        // Names of other kinds (http:…) are not files; absolute ones mean the same everywhere
        const bool is_other = path.find("://") != std::string::npos;
        if (!anchor.layer || is_other || fs::path(path).is_absolute()) return path;
        const std::string file = stage_.resolve_asset(path, *anchor.layer);
        // A search path that finds nothing here may find it elsewhere
        const bool is_anchored = path.starts_with("./") || path.starts_with("../");
        if (!is_anchored && !compose::LayerRegistry::exists(file)) return path;
        if (folder_.empty() || !fs::path(file).is_absolute()) return file;
        const fs::path relative = fs::path(file).lexically_relative(folder_);
        if (relative.empty()) return file;
        const std::string text = relative.generic_string();
        return text.starts_with("..") ? text : "./" + text;
    }

    Value anchored(const Value& value,
                   const AssetAnchor& anchor,
                   const std::string& prim,
                   SourceLoc loc) const {
        if (const auto* one = value.get_if<layer::AssetPath>())
            return Value(layer::AssetPath{anchored(one->path, anchor, prim, loc)});
        if (value.holds_array<layer::AssetPath>()) {
            std::vector<layer::AssetPath> paths;
            for (const layer::AssetPath& asset : value.as_array<layer::AssetPath>())
                paths.push_back({anchored(asset.path, anchor, prim, loc)});
            return Value::array(std::move(paths));
        }
        if (const auto* dictionary = value.get_if<layer::Dictionary>()) {
            layer::Dictionary result = *dictionary;
            for (auto& entry : result.entries)
                entry.second = anchored(entry.second, anchor, prim, loc);
            return Value(std::move(result));
        }
        return value;
    }

  private:
    StageImpl& stage_;
    std::string folder_;
};

layer::SplineValue retimed_spline(layer::SplineValue spline, const layer::LayerOffset& to_stage) {
    if (to_stage.is_identity()) return spline;
    const double scale = to_stage.scale;
    const auto value = [&](double v) { return spline.is_time_valued ? to_stage.apply(v) : v; };
    const double slope_scale = spline.is_time_valued ? 1.0 : 1.0 / scale;
    for (layer::SplineKnot& knot : spline.knots) {
        knot.time = to_stage.apply(knot.time);
        knot.value = value(knot.value);
        knot.pre_value = value(knot.pre_value);
        for (layer::SplineTangent* tangent : {&knot.pre, &knot.post}) {
            tangent->width *= scale;
            tangent->slope *= slope_scale;
        }
    }
    spline.pre.slope *= slope_scale;
    spline.post.slope *= slope_scale;
    if (spline.loop != decltype(spline.loop)()) {
        spline.loop.start = to_stage.apply(spline.loop.start);
        spline.loop.end = to_stage.apply(spline.loop.end);
    }
    if (spline.is_time_valued) spline.loop.value_offset *= scale;
    return spline;
}

class Flattener {
  public:
    Flattener(const Stage& stage, const FlattenOptions& options)
        : stage_(stage),
          impl_(*stage.pseudo_root().data()->stage),
          assets_(impl_, options.asset_folder),
          out_(std::make_shared<layer::Layer>("anonymous:flattened")) {}

    std::shared_ptr<layer::Layer> run() {
        write_stage_metadata();
        for (const Prim& prim : stage_.pseudo_root().all_children()) write_prim(prim, prim.path());
        // Prototypes may hold instances of further prototypes
        for (size_t i = 0; i < prototypes_.size(); ++i) {
            const Path root = prototype_path(i);
            create(root, SpecKind::Prim, {});
            set(root, layer::fields().specifier, Value(layer::Specifier::Over), {});
            const Prim prototype = prototypes_[i];
            const Path from = prototype.path();
            mapped_from_ = from;
            mapped_to_ = root;
            for (const Prim& child : prototype.all_children())
                write_prim(child, root.append_child(child.name()));
            mapped_from_ = mapped_to_ = Path();
        }
        return out_;
    }

  private:
    layer::Spec& create(Path path, SpecKind kind, SourceLoc loc) {
        return out_->create_spec(path, kind, loc);
    }

    void set(Path path, Token name, Value value, SourceLoc loc) {
        if (layer::Spec* spec = out_->spec(path)) spec->set_field(name, std::move(value), loc);
    }

    /// A name that no prim of the stage has.
    Path prototype_path(size_t i) {
        if (names_.empty()) {
            for (const Prim& prim : stage_.pseudo_root().all_children())
                names_.insert(prim.name().str());
        }
        std::string name = fmt::format("{}{}", flattened_prototype_prefix, i + 1);
        while (names_.count(name) != 0) name += "_";
        return Path::absolute_root().append_child(name);
    }

    void write_stage_metadata() {
        for (const std::string& key : stage_.metadata_keys()) {
            std::vector<Value> values;
            for (const layer::Layer* layer : impl_.root_layers()) {
                const layer::Field* field = layer->pseudo_root().find_field(Token(key));
                if (!field) continue;
                AssetAnchor anchor = root_anchor(*layer);
                values.push_back(assets_.anchored(field->value, anchor, "/", field->loc));
            }
            if (auto value = compose_values(values))
                out_->pseudo_root().set_field(Token(key), *std::move(value), {});
        }
        // Times are in stage time already: the rate that other layers were retimed to must stay
        if (!out_->has_time_codes_per_second() && stage_.time_codes_per_second() != 24.0) {
            out_->pseudo_root().set_field(layer::fields().time_codes_per_second,
                                          Value(stage_.time_codes_per_second()), {});
        }
    }

    AssetAnchor root_anchor(const layer::Layer& layer) const {
        const compose::LayerStack* stack = impl_.composer().root_stack();
        for (const compose::StackLayer& entry : stack->layers()) {
            if (entry.layer.get() == &layer) return {entry.layer, stack};
        }
        return {};
    }

    /// Copies a prim and what is below it.
    void write_prim(const Prim& root, Path root_path) {
        std::vector<std::pair<Prim, Path>> open = {{root, root_path}};
        while (!open.empty()) {
            const auto [prim, path] = open.back();
            open.pop_back();
            write_prim_spec(prim, path);
            if (prim.is_instance()) {
                refer_to_prototype(prim, path);
                continue;
            }
            const std::vector<Prim> children = prim.all_children();
            for (auto child = children.rbegin(); child != children.rend(); ++child)
                open.emplace_back(*child, path.append_child(child->name()));
        }
    }

    void refer_to_prototype(const Prim& prim, Path path) {
        const Prim prototype = prim.prototype();
        auto found = std::find(prototypes_.begin(), prototypes_.end(), prototype);
        const size_t i = size_t(found - prototypes_.begin());
        if (found == prototypes_.end()) prototypes_.push_back(prototype);
        layer::Reference reference;
        reference.prim_path = prototype_path(i);
        set(path, layer::fields().references,
            Value(layer::ReferenceListOp::make_explicit({reference})), prim.loc());
    }

    void write_prim_spec(const Prim& prim, Path path) {
        const layer::FieldNames& names = layer::fields();
        create(path, SpecKind::Prim, prim.loc());
        set(path, names.specifier, Value(prim.specifier()), prim.loc());
        if (!prim.type_name().empty())
            set(path, names.type_name, Value(prim.type_name()), prim.loc());
        std::vector<Token> keys;
        for (const std::string& key : prim.metadata_keys()) keys.emplace_back(key);
        keys.push_back(names.active);
        keys.push_back(names.api_schemas);
        std::vector<SpecSource> sources;
        for (const SpecRef& ref : prim.data()->specs) sources.push_back({ref.spec, &ref});
        copy_metadata(prim, path, sources, keys);
        write_variants(prim, path);
        for (const Token& name : prim.property_names()) {
            const Attribute attribute = prim.attribute(name.view());
            if (attribute.is_authored()) {
                write_attribute(attribute, path.append_property(name));
            } else if (const Relationship relationship = prim.relationship(name.view())) {
                write_relationship(relationship, path.append_property(name));
            }
        }
    }

    struct SpecSource {
        const layer::Spec* spec = nullptr;
        const SpecRef* prim_spec = nullptr;
    };

    void copy_metadata(const Prim& prim,
                       Path path,
                       const std::vector<SpecSource>& sources,
                       const std::vector<Token>& keys) {
        const std::string where = prim.path_string();
        for (const Token& key : keys) {
            std::vector<Value> values;
            SourceLoc loc;
            for (const SpecSource& source : sources) {
                const layer::Field* field = source.spec->find_field(key);
                if (!field) continue;
                if (values.empty()) loc = field->loc;
                const compose::Node& node =
                    prim.data()->index.nodes()[size_t(source.prim_spec->node)];
                values.push_back(assets_.anchored(
                    stage_value(*prim.data(), *source.prim_spec, field->value),
                    {source.prim_spec->layer->layer, node.stack}, where, field->loc));
            }
            if (auto value = compose_values(values)) set(path, key, *std::move(value), loc);
        }
    }

    void write_variants(const Prim& prim, Path path) {
        const auto selections = prim.variant_selections();
        if (selections.empty()) return;
        std::vector<std::string> sets;
        layer::VariantSelections chosen;
        for (const auto& selection : selections) {
            sets.push_back(selection.first);
            if (selection.second.empty()) continue;
            chosen.push_back(selection);
            const Token set_name(selection.first);
            create(path.append_variant_selection(set_name, Token()), SpecKind::VariantSet,
                   prim.loc());
            create(path.append_variant_selection(set_name, Token(selection.second)),
                   SpecKind::Variant, prim.loc());
        }
        set(path, layer::fields().variant_set_names,
            Value(layer::StringListOp::make_explicit(std::move(sets))), prim.loc());
        if (!chosen.empty())
            set(path, layer::fields().variant_selection, Value(std::move(chosen)), prim.loc());
    }

    void write_property(const Prim& prim,
                        Token name,
                        Path path,
                        const std::vector<std::string>& metadata) {
        std::vector<SpecSource> sources;
        for (const PropertySpec& spec : property_specs(*prim.data(), name))
            sources.push_back({spec.spec, spec.prim_spec});
        std::vector<Token> keys;
        for (const std::string& key : metadata) keys.emplace_back(key);
        copy_metadata(prim, path, sources, keys);
    }

    void write_attribute(const Attribute& a, Path path) {
        const layer::FieldNames& names = layer::fields();
        const Prim prim = a.prim();
        create(path, SpecKind::Attribute, a.loc());
        const Token type = written_type(a);
        if (!type.empty()) set(path, names.type_name, Value(type), a.loc());
        if (a.is_custom()) set(path, names.custom, Value(true), a.loc());
        if (a.is_uniform())
            set(path, names.variability, Value(layer::Variability::Uniform), a.loc());
        write_property(prim, a.name(), path, a.metadata_keys());
        write_default(a, path);
        write_animation(a, path);
        if (a.has_authored_connections()) {
            set(path, names.connection_paths,
                Value(layer::PathListOp::make_explicit(mapped(a.connections()))), a.loc());
        }
    }

    /// The type that what is written has: the composed one, unless the opinion that decides is of
    /// another, as its own layer declares it.
    static Token written_type(const Attribute& a) {
        Token type = a.type_name();
        visit_value_opinions(*a.prim().data(), a.name(), [&](const ValueOpinion& opinion) {
            if (!opinion.spec.spec || opinion.source == ValueSource::Blocked) return true;
            Value value = opinion.field->value;
            if (const auto* samples = value.get_if<layer::TimeSamples>()) value = samples->value(0);
            const layer::TypeInfo* info = layer::find_type(type);
            const bool fits =
                info && info->type == value.type() && info->is_array == value.is_array();
            const Token declared = opinion.spec.spec->type_name();
            if (!fits && layer::is_attribute_type(value.type()) && !declared.empty())
                type = declared;
            return false;
        });
        return type;
    }

    void write_default(const Attribute& a, Path path) {
        const PrimData& prim = *a.prim().data();
        ValueOpinion strongest;
        visit_value_opinions(prim, a.name(), [&](const ValueOpinion& opinion) {
            const bool is_default =
                opinion.source == ValueSource::Default || opinion.source == ValueSource::Blocked;
            if (!is_default || opinion.is_animation_block()) return true;
            strongest = opinion;
            return false;
        });
        if (!strongest.field) return;
        const Value& authored = strongest.field->value;
        const Value value = mapped(stage_value(prim, *strongest.spec.prim_spec, authored));
        set(path, layer::fields().default_value,
            assets_.anchored(value, asset_anchor(prim, strongest, {}), a.prim().path_string(),
                             strongest.field->loc),
            strongest.field->loc);
    }

    void write_animation(const Attribute& a, Path path) {
        const PrimData& prim = *a.prim().data();
        const ValueOpinion winner = find_value_opinion(prim, a.name(), false);
        const std::string where = a.prim().path_string();
        if (winner.source == ValueSource::Spline) {
            const auto& spline = *winner.field->value.get_if<layer::SplineValue>();
            set(path, layer::fields().spline, Value(retimed_spline(spline, winner.spec.to_stage)),
                winner.field->loc);
            return;
        }
        write_empty_spline(prim, a.name(), path);
        std::vector<std::pair<double, Value>> samples;
        if (winner.source == ValueSource::TimeSamples) {
            const auto& held = *winner.field->value.get_if<layer::TimeSamples>();
            const AssetAnchor anchor = asset_anchor(prim, winner, {});
            for (size_t i = 0; i < held.size(); ++i) {
                const Value value = retime_value(held.value(i), winner.spec.to_stage);
                samples.emplace_back(winner.spec.to_stage.apply(held.times()[i]),
                                     assets_.anchored(value, anchor, where, winner.field->loc));
            }
        } else if (winner.source == ValueSource::Clips) {
            for (const double t : winner.sample_times()) {
                samples.emplace_back(
                    t, assets_.anchored(winner.clips->value_at_sample(winner.clip_attribute, t),
                                        asset_anchor(prim, winner, t), where, {}));
            }
        }
        if (samples.empty()) return;
        set(path, layer::fields().time_samples, Value(layer::TimeSamples(std::move(samples))),
            winner.loc());
    }

    /// A spline without knots has no value and hides none; it is kept since someone wrote it.
    void write_empty_spline(const PrimData& prim, Token name, Path path) {
        const layer::FieldNames& names = layer::fields();
        for (const PropertySpec& spec : property_specs(prim, name)) {
            if (const layer::Field* field = spec.spec->find_field(names.spline)) {
                const auto* spline = field->value.get_if<layer::SplineValue>();
                if (spline && spline->knots.empty())
                    set(path, names.spline, Value(retimed_spline(*spline, spec.to_stage)),
                        field->loc);
                return;
            }
            const Value* value = spec.spec->field(names.default_value);
            if (value && (value->is_block() || value->is_animation_block())) return;
        }
    }

    void write_relationship(const Relationship& r, Path path) {
        const layer::FieldNames& names = layer::fields();
        create(path, SpecKind::Relationship, r.loc());
        if (r.is_custom()) set(path, names.custom, Value(true), r.loc());
        write_property(r.prim(), r.name(), path, r.metadata_keys());
        if (r.has_authored_targets()) {
            set(path, names.target_paths,
                Value(layer::PathListOp::make_explicit(mapped(r.targets()))), r.loc());
        }
    }

    /// Inside a prototype, targets within it follow it to its new place.
    std::vector<Path> mapped(std::vector<Path> paths) const {
        if (mapped_from_.is_empty()) return paths;
        for (Path& path : paths) {
            if (path.has_prefix(mapped_from_)) path = path.replace_prefix(mapped_from_, mapped_to_);
        }
        return paths;
    }

    /// The same for the paths of an expression.
    Value mapped(const Value& value) const {
        const auto* expression = value.get_if<layer::PathExpression>();
        if (!expression || mapped_from_.is_empty()) return value;
        const auto follow = [this](Path path) { return mapped(std::vector<Path>{path}).front(); };
        return Value(layer::PathExpression{
            path_expression_text(expression->text, Path::absolute_root(), follow)});
    }

    const Stage& stage_;
    StageImpl& impl_;
    AssetAnchorer assets_;
    std::shared_ptr<layer::Layer> out_;
    std::vector<Prim> prototypes_;
    std::set<std::string> names_;
    Path mapped_from_;
    Path mapped_to_;
};

}  // namespace

std::shared_ptr<layer::Layer> flatten_stage(const Stage& stage, const FlattenOptions& options) {
    return Flattener(stage, options).run();
}

}  // namespace velatura::usd::stage
