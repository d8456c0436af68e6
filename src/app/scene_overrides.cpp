// SPDX-License-Identifier: Apache-2.0
#include "app/scene_overrides.h"

#include "base/asset_bytes.h"
#include "base/nearest_names.h"
#include "translate/known_names.h"
#include "usd/layer/fields.h"
#include "usd/stage/variants.h"
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

namespace velatura::app {

namespace {

using usd::layer::Layer;
using usd::layer::Path;
using usd::layer::SpecKind;
using usd::layer::Token;
using usd::layer::Value;
using usd::stage::Prim;
using usd::stage::Stage;

std::string absolute(const std::string& path) {
    std::error_code failed;
    return std::filesystem::absolute(path, failed).lexically_normal().string();
}

std::string_view trimmed(std::string_view text) {
    const size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

Error usage(const char* option, const std::string& text, const std::string& problem) {
    return {"usage", fmt::format("{} {}: {}", option, text, problem)};
}

/// A value as typed.
struct TypedValue {
    std::string declaration;  ///< "float", "uniform token", "rel"; empty: as the attribute is
    Path property;
    bool is_connection = false;  ///< .connect
    std::string value;
};

/// Error: the message alone.
Result<TypedValue> parse_value(const std::string& text) {
    const size_t slash = text.find('/');
    const size_t equals = text.find('=', slash == std::string::npos ? 0 : slash);
    const auto problem = [](std::string message) { return Error{"usage", std::move(message)}; };
    if (slash == std::string::npos || equals == std::string::npos)
        return problem("expected /Prim.attribute=value");
    TypedValue out;
    out.declaration = trimmed(std::string_view(text).substr(0, slash));
    std::string_view path = trimmed(std::string_view(text).substr(slash, equals - slash));
    constexpr std::string_view connect = ".connect";
    if (path.ends_with(connect) && path.find('.') != path.size() - connect.size()) {
        out.is_connection = true;
        path.remove_suffix(connect.size());
    }
    const Result<Path> parsed = Path::parse(path);
    if (!parsed) return problem(parsed.error().message);
    if (!parsed->is_property() || parsed->has_variant_selection() || parsed->has_target())
        return problem(
            fmt::format("\"{}\" is not an attribute path; expected /Prim.attribute=value", path));
    out.property = *parsed;
    out.value = trimmed(std::string_view(text).substr(equals + 1));
    if (out.value.empty()) return problem("missing value after '='");
    return out;
}

/// Error: the message alone.
Result<Path> parse_variant(const std::string& text) {
    const Result<Path> parsed = Path::parse(text);
    if (!parsed) return Error{"usage", parsed.error().message};
    if (!parsed->is_absolute() || !parsed->is_variant_selection() || !parsed->parent().is_prim() ||
        parsed->parent().has_variant_selection())
        return Error{"usage", "expected /Prim{set=name}"};
    return *parsed;
}

/// The prim, or why opinions cannot reach it.
Result<Prim> prim_to_author(const Stage& stage, Path path) {
    const auto problem = [](std::string message) { return Error{"usage", std::move(message)}; };
    Prim parent = stage.pseudo_root();
    for (const Path& prefix : path.prefixes()) {
        const std::string name = prefix.name().str();
        // Opinions alone make an `over` of what is not there
        const Prim prim = parent.child(name);
        if (!prim || !prim.is_defined()) {
            std::vector<std::string> names;
            for (const Prim& child : parent.all_children())
                if (child.is_defined()) names.push_back(child.name().str());
            return problem(fmt::format("prim <{}> not found{}", prefix.to_string(),
                                       did_you_mean(name, names)));
        }
        if (prim.is_instance_proxy())
            return problem(
                fmt::format("<{}> is inside the instance <{}>, where opinions are ignored; set "
                            "them on the prim that it references",
                            prefix.to_string(), parent.path_string()));
        parent = prim;
    }
    return parent;
}

/// The layer that holds what --variant and --set say.
class OverrideLayer {
  public:
    explicit OverrideLayer(Diagnostics& diagnostics)
        : layer_(std::make_shared<Layer>(override_layer_name())), diagnostics_(diagnostics) {}

    const std::shared_ptr<Layer>& layer() const { return layer_; }

    void select(Path variant, const std::string& text) {
        usd::layer::Spec& spec = over(variant.prim_path());
        const Token field = usd::layer::fields().variant_selection;
        usd::layer::VariantSelections selections;
        if (const auto* known = spec.field_as<usd::layer::VariantSelections>(field))
            selections = *known;
        const std::string set = variant.variant_set().str();
        std::erase_if(selections, [&](const auto& s) { return s.first == set; });
        selections.emplace_back(set, variant.variant().str());
        spec.set_field(field, Value(std::move(selections)), place("--variant", text));
    }

    /// Makes the prim's opinions count; before the stage is opened.
    usd::layer::Spec& over(Path prim) {
        for (const Path& prefix : prim.prefixes()) layer_->create_spec(prefix, SpecKind::Prim, {});
        return *layer_->spec(prim);
    }

    /// Error: the message alone.
    Result<void> set(const Stage& stage, const TypedValue& typed, const std::string& text) {
        const Result<Prim> prim = prim_to_author(stage, typed.property.prim_path());
        if (!prim) return prim.error();
        const Result<std::string> declaration = declaration_of(*prim, typed);
        if (!declaration) return declaration.error();
        return author(typed, *declaration, value_text(*declaration, typed), place("--set", text));
    }

    std::string text() const { return usd::text::write_text_layer(*layer_); }

  private:
    /// Messages name the option where they name the file of other opinions.
    SourceLoc place(const char* option, const std::string& text) {
        return {diagnostics_.file_id(fmt::format("{} {}", option, text)), 0, 0};
    }

    /// What stands before the name in a layer.
    static Result<std::string> declaration_of(Prim prim, const TypedValue& typed) {
        if (!typed.declaration.empty()) return typed.declaration;
        const std::string name = typed.property.name().str();
        const usd::stage::Attribute attribute = prim.attribute(name);
        if (prim.relationship(name).is_valid() || name.starts_with("material:binding"))
            return std::string("rel");
        const std::string type = attribute.is_valid() ? attribute.type_name().str() : "";
        if (!type.empty()) return (attribute.is_uniform() ? "uniform " : "") + type;
        std::vector<std::string> names = translate::known_names(prim).names;
        for (const Token& known : prim.property_names()) names.push_back(known.str());
        // Known, but declared by no schema: only its type lacks
        const bool is_known = std::find(names.begin(), names.end(), name) != names.end();
        return Error{
            "usage",
            fmt::format("<{}> has no attribute {}{}; a new one needs a type: --set '{} "
                        "{}={}'",
                        prim.path_string(), name,
                        is_known ? std::string() : did_you_mean(name, names),
                        likely_type(typed.value), typed.property.to_string(), typed.value)};
    }

    /// The type that a value on the command line suggests.
    static std::string_view likely_type(const std::string& value) {
        const bool is_number =
            !value.empty() && value.find_first_not_of("+-.0123456789eE") == std::string::npos;
        if (is_number) return "float";
        if (value == "true" || value == "false") return "bool";
        if (value.starts_with('@')) return "asset";
        if (value.starts_with('(')) return "float3";
        if (value.starts_with('[')) return "float[]";
        return "token";
    }

    /// Quotes that a shell has taken are put back.
    static std::string value_text(const std::string& declaration, const TypedValue& typed) {
        if (typed.is_connection || typed.value == "None") return typed.value;
        const size_t blank = declaration.rfind(' ');
        const std::string type = declaration.substr(blank == std::string::npos ? 0 : blank + 1);
        const char first = typed.value.front();
        if ((type == "token" || type == "string") && first != '"' && first != '\'')
            return fmt::format("\"{}\"", typed.value);
        if (type == "asset" && first != '@') return fmt::format("@{}@", typed.value);
        return typed.value;
    }

    Result<void> author(const TypedValue& typed,
                        const std::string& declaration,
                        const std::string& value,
                        SourceLoc loc) {
        const auto problem = [](std::string message) { return Error{"usage", std::move(message)}; };
        const std::vector<Path> prims = typed.property.prim_path().prefixes();
        std::string before = "#usda 1.0\n", after;
        for (const Path& prim : prims) {
            before += fmt::format("over \"{}\" {{ ", prim.name().str());
            after += "\n}";
        }
        const std::string statement =
            fmt::format("{} {}{} = ", declaration, typed.property.name().str(),
                        typed.is_connection ? ".connect" : "");
        Diagnostics diagnostics;
        const auto read = usd::text::read_text_layer(
            before + "\n" + statement + value + after + "\n", override_layer_name(), diagnostics);
        constexpr uint32_t line_of_value = 3;
        for (const Diagnostic& d : diagnostics.all()) {
            if (d.severity != Severity::Error && d.code != "usd-unknown-type") continue;
            const bool is_in_value = d.loc.line == line_of_value && d.loc.column > statement.size();
            return problem(fmt::format(
                "cannot read the value of type {}{}: {}", declaration,
                is_in_value ? fmt::format(", character {}", size_t(d.loc.column) - statement.size())
                            : "",
                d.message));
        }
        if (!read) return problem(read.error().message);
        // The value must not bring anything else along
        const usd::layer::Spec* const property = (*read)->spec(typed.property);
        if (!property || (*read)->spec_count() != prims.size() + 2)
            return problem("expected one value, found more");
        over(typed.property.prim_path());
        usd::layer::Spec& spec = layer_->create_spec(typed.property, property->kind(), loc);
        spec.set_loc(loc);
        for (const usd::layer::Field& field : property->fields())
            spec.set_field(field.name, field.value, loc);
        return {};
    }

    std::shared_ptr<Layer> layer_;
    Diagnostics& diagnostics_;
};

/// Whether the composed stage has what --variant chose.
Result<void> check_variant(const Stage& stage, Path variant) {
    const Result<Prim> prim = prim_to_author(stage, variant.prim_path());
    if (!prim) return prim.error();
    const std::string set = variant.variant_set().str(), name = variant.variant().str();
    const std::vector<std::string> offered = usd::stage::variant_names(*prim, set);
    if (std::find(offered.begin(), offered.end(), name) != offered.end()) return {};
    const auto list = [](const std::vector<std::string>& names) {
        return fmt::format("{}", fmt::join(names, ", "));
    };
    if (!offered.empty())
        return Error{"usage",
                     fmt::format("the set has no variant {}: expected {}", name, list(offered))};
    std::vector<std::string> sets;
    for (const auto& [known, selected] : prim->variant_selections()) sets.push_back(known);
    return Error{"usage", fmt::format("<{}> has no variant set {}: {}", prim->path_string(), set,
                                      sets.empty() ? "it has none" : "it has " + list(sets))};
}

/// Whether something at the other end of a connection takes the place of the attribute's value.
bool has_value_source(const Stage& stage, Path target) {
    const Prim prim = stage.prim_at(target.prim_path());
    if (!prim) return false;
    const std::string name = target.name().str();
    const usd::stage::Attribute source = prim.attribute(name);
    return source.has_authored_value() || source.has_authored_connections() ||
           (prim.type_name() == "Shader" && name.starts_with("outputs:"));
}

/// Of shading inputs and outputs a connection is stronger than a value.
void warn_of_connection(const Stage& stage,
                        const TypedValue& typed,
                        const std::string& text,
                        Diagnostics& diagnostics) {
    const std::string name = typed.property.name().str();
    if (typed.is_connection || !(name.starts_with("inputs:") || name.starts_with("outputs:")))
        return;
    const Prim prim = stage.prim_at(typed.property.prim_path());
    const std::vector<Path> targets = prim.attribute(name).connections();
    if (targets.empty() || !has_value_source(stage, targets.front())) return;
    diagnostics.warn("set-connected", {diagnostics.file_id("--set " + text), 0, 0},
                     prim.path_string(),
                     fmt::format("the value has no effect, because {} is connected to <{}>; remove "
                                 "the connection with --set '{}.connect=None'",
                                 name, targets.front().to_string(), typed.property.to_string()));
}

/// Errors of the parser for an option's check.
template <class Parse>
auto problem_of(Parse parse) {
    return [parse](const std::string& text) {
        const auto parsed = parse(text);
        return parsed ? std::string() : fmt::format("{}: {}", text, parsed.error().message);
    };
}

}  // namespace

void add_override_options(Command& command, SceneOverrides& overrides) {
    command
        .add_option("--session", overrides.sessions,
                    "Session layer: opinions stronger than the scene's, e.g. from `velatura-comp "
                    "bake`; the last is the strongest")
        .type_name("FILE")
        .expected(1)
        .take_all()
        .reads();
    command
        .add_option("--variant", overrides.variants, "Variant selection, stronger than --session")
        .type_name("/Prim{set=name}")
        .expected(1)
        .take_all()
        .check(problem_of(parse_variant));
    command
        .add_option("--set", overrides.values,
                    "Attribute value as in .usda, stronger than --session, e.g. "
                    "/Sun.inputs:intensity=2; quotes of tokens, strings and asset paths are "
                    "optional; a new attribute needs its type ('float /Prim.x=1')")
        .type_name("/Prim.attribute=value")
        .expected(1)
        .take_all()
        .check(problem_of(parse_value));
}

std::string override_layer_name() {
    return absolute("command line");
}

Result<void> add_session_layers(const SceneOverrides& overrides,
                                usd::stage::StageOptions& options) {
    for (auto file = overrides.sessions.rbegin(); file != overrides.sessions.rend(); ++file) {
        options.session_layers.push_back(absolute(*file));
        if (!asset_exists(options.session_layers.back()))
            return usage("--session", *file, "file not found");
    }
    return {};
}

Result<OverriddenStage> open_stage(const SceneOverrides& overrides,
                                   const std::string& scene,
                                   usd::stage::StageOptions options,
                                   Diagnostics& diagnostics) {
    if (const Result<void> ok = add_session_layers(overrides, options); !ok) return ok.error();
    OverrideLayer layer(diagnostics);
    for (const std::string& text : overrides.variants) layer.select(*parse_variant(text), text);
    for (const std::string& text : overrides.values)
        layer.over(parse_value(text)->property.prim_path());
    const bool has_layer = !overrides.variants.empty() || !overrides.values.empty();
    if (has_layer) options.made_layer = layer.layer();

    Result<Stage> stage = Stage::open(scene, options, diagnostics);
    if (!stage) return stage.error();
    for (const std::string& text : overrides.variants) {
        if (const auto ok = check_variant(*stage, *parse_variant(text)); !ok)
            return usage("--variant", text, ok.error().message);
    }
    // The types of the values are known only now
    for (const std::string& text : overrides.values) {
        if (const auto ok = layer.set(*stage, *parse_value(text), text); !ok)
            return usage("--set", text, ok.error().message);
    }
    for (const std::string& text : overrides.values)
        warn_of_connection(*stage, *parse_value(text), text, diagnostics);
    return OverriddenStage{std::move(*stage), has_layer ? layer.text() : std::string()};
}

}  // namespace velatura::app
