// SPDX-License-Identifier: Apache-2.0
#include "translate/authored_names.h"

#include "base/nearest_names.h"
#include "translate/context/values.h"
#include "translate/known_names.h"
#include "translate/lights/light_filters.h"
#include "translate/schema_support.h"
#include "usd/layer/type_name.h"
#include "usd/stage/schema_fallbacks.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace velatura::translate {

namespace {

using usd::layer::Token;
using usd::layer::Value;
using usd::stage::Attribute;
using usd::stage::Prim;

/// One warning, for all prims that give cause to it.
struct Finding {
    std::string code;
    SourceLoc loc;
    std::string prim;
    std::string message;
    size_t prims = 0;
};

/// What is wrong with a name on prims of one kind.
struct Verdict {
    std::string code;     ///< empty: nothing
    std::string message;  ///< complete but for the number of prims
    const usd::stage::SchemaAttribute* declared = nullptr;
    const UnusedAttribute* unused = nullptr;  ///< with a consequence
    const TokenChoice* choice = nullptr;      ///< tokens to check
    const ForeignRequest* request = nullptr;  ///< of another renderer
    std::string_view renderer;
};

/// Names of those that user data, and programs that are no renderers, keep to.
bool is_users_own(std::string_view name) {
    static constexpr std::array<std::string_view, 10> spaces = {
        "userProperties:", "ui:",       "physics:", "physx", "semantics:",
        "houdini",         "coordSys:", "blender:", "maya",  "adskasset"};
    return std::any_of(spaces.begin(), spaces.end(),
                       [&](std::string_view space) { return name.starts_with(space); });
}

/// A value as it stands in the tables; nothing for arrays and vectors.
std::optional<std::string> short_text(const Value& value) {
    if (value.is_array()) return std::nullopt;
    if (const auto* token = value.get_if<Token>()) return token->str();
    if (const auto* text = value.get_if<std::string>()) return *text;
    if (const auto* asset = value.get_if<usd::layer::AssetPath>()) return asset->path;
    std::vector<double> rows;
    int width = 0;
    if (!read_rows(value, rows, width) || width != 1 || rows.size() != 1) return std::nullopt;
    return fmt::format("{:g}", rows[0]);
}

/// What readers tell values apart by.
struct Shape {
    enum class Kind { Text, Numbers, Other } kind = Kind::Other;
    int width = 0;  ///< of Numbers
    bool is_array = false;

    bool operator==(const Shape&) const = default;
};

Shape shape_of(std::string_view type_name) {
    using usd::layer::ValueType;
    const usd::layer::TypeInfo* info = usd::layer::find_type(type_name);
    if (!info) return {};
    switch (info->type) {
        case ValueType::String:
        case ValueType::Token:
        case ValueType::Asset:
            return {Shape::Kind::Text, 0, info->is_array};
        case ValueType::Opaque:
        case ValueType::PathExpression:
            return {};
        default:
            return {Shape::Kind::Numbers, info->rows * info->columns, info->is_array};
    }
}

std::string hint(const std::string& nearest) {
    return nearest.empty() ? std::string() : fmt::format(" (did you mean '{}'?)", nearest);
}

const std::vector<std::string>& stage_metadata() {
    static const std::vector<std::string> names = {
        "defaultPrim",        "upAxis",      "metersPerUnit",          "kilogramsPerUnit",
        "startTimeCode",      "endTimeCode", "timeCodesPerSecond",     "framesPerSecond",
        "framePrecision",     "subLayers",   "renderSettingsPrimPath", "customLayerData",
        "expressionVariables"};
    return names;
}

const std::vector<std::string>& prim_metadata() {
    static const std::vector<std::string> names = {
        "apiSchemas",  "instanceable", "active",      "hidden",      "kind",
        "customData",  "assetInfo",    "references",  "payload",     "inherits",
        "specializes", "variants",     "variantSets", "inactiveIds", "documentation"};
    return names;
}

const std::vector<std::string>& property_metadata() {
    static const std::vector<std::string> names = {"interpolation", "elementSize",
                                                   "colorSpace",    "displayName",
                                                   "customData",    "bindMaterialAs"};
    return names;
}

class NameCheck {
  public:
    explicit NameCheck(const usd::stage::Stage& stage) : stage_(stage) {}

    void run() {
        check_stage();
        visit_children(stage_.pseudo_root());
    }

    void report(Diagnostics& diagnostics) const {
        for (const Finding& f : findings_)
            diagnostics.warn(f.code, f.loc, f.prim,
                             f.prims == 1 ? f.message
                                          : fmt::format("{} ({} prims, the first is named)",
                                                        f.message, f.prims));
    }

  private:
    /// The names that prims of one kind know, and what was found out of others.
    struct Kind {
        KnownNames known;
        std::unordered_map<Token, Verdict> verdicts;
    };

    void add(const char* code, SourceLoc loc, const std::string& prim, std::string message) {
        const auto [at, is_new] =
            places_.try_emplace(std::string(code) + message, findings_.size());
        if (is_new) findings_.push_back({code, loc, prim, std::move(message), 0});
        ++findings_[at->second].prims;
    }

    void visit_children(Prim prim) {
        if (prim.is_instance()) {
            const Prim prototype = prim.prototype();
            if (!prototypes_.insert(prototype.path_string()).second) return;
            prim = prototype;
        }
        for (const Prim child : prim.all_children()) {
            if (!child.is_active() || !child.is_loaded()) continue;
            check(child);
            visit_children(child);
        }
    }

    void check_stage() {
        for (const std::string& key : stage_.metadata_keys()) {
            const std::string nearest = nearest_spelling(key, stage_metadata());
            if (!nearest.empty())
                add("unknown-metadata", stage_.pseudo_root().loc(), "/",
                    fmt::format("unknown metadata {} of the stage{}; it is ignored", key,
                                hint(nearest)));
        }
    }

    void check(Prim prim) {
        if (lights::is_light_filter(prim)) return;
        check_type(prim);
        for (const std::string& key : prim.metadata_keys()) {
            const std::string nearest = nearest_spelling(key, prim_metadata());
            if (!nearest.empty())
                add("unknown-metadata", prim.loc(), prim.path_string(),
                    fmt::format("unknown metadata {}{}; it is ignored", key, hint(nearest)));
        }
        const std::vector<Token> properties = prim.property_names();
        if (properties.empty()) return;
        Kind& kind = kind_of(prim);
        bool has_ops = false;
        for (const Token& name : properties) {
            has_ops = has_ops || name.view().starts_with("xformOp");
            const auto [at, is_new] = kind.verdicts.try_emplace(name);
            if (is_new) at->second = judge(prim, name, kind.known);
            apply(prim, name, at->second);
        }
        if (has_ops) check_ops(prim, properties);
    }

    Kind& kind_of(Prim prim) {
        std::string key = prim.type_name().str();
        for (const Token& api : prim.applied_schemas()) key += "|" + api.str();
        if (prim.type_name() == "Shader")
            key += "#" + prim.attribute("info:id").get<std::string>().value_or("");
        const auto [at, is_new] = kinds_.try_emplace(key);
        if (is_new) at->second.known = known_names(prim);
        return at->second;
    }

    void check_type(Prim prim) {
        const std::string& type = prim.type_name().str();
        const auto& types = known_types();
        const bool is_known = type.empty() || is_without_image(type) ||
                              std::find(types.begin(), types.end(), type) != types.end();
        if (!is_known)
            add("unknown-type", prim.loc(), prim.path_string(),
                fmt::format("unknown type {}{}; the prim is skipped, what is below it is not", type,
                            hint(nearest_spelling(type, types))));
        for (const Token& token : prim.applied_schemas()) {
            const std::string api(token.view().substr(0, token.view().find(':')));
            if (is_without_image(api)) continue;
            const std::string nearest = nearest_spelling(api, known_apis());
            if (!nearest.empty())
                add("unknown-api", prim.loc(), prim.path_string(),
                    fmt::format("unknown API schema {}{}; it is ignored", api, hint(nearest)));
        }
    }

    /// What a name on prims of this kind is worth.
    Verdict judge(Prim prim, const Token& token, const KnownNames& known) const {
        const std::string& name = token.str();
        Verdict v;
        if (const auto declared = known.attributes.find(name); declared != known.attributes.end()) {
            v.declared = declared->second;
            for (const UnusedAttribute& row : unused_attributes())
                if (row.schema == v.declared->schema && row.attribute == name &&
                    !row.consequence.empty())
                    v.unused = &row;
            for (const TokenChoice& choice : token_choices())
                if (choice.attribute == name) v.choice = &choice;
            return v;
        }
        if (name.starts_with("xformOp:") || is_users_own(name)) return v;
        if (const ForeignName foreign = foreign_name(name); foreign.renderer) {
            if (foreign.request && !foreign.request->what_is_done.empty()) {
                v.request = foreign.request;
                v.renderer = foreign.renderer->name;
            }
            return v;
        }
        const std::string nearest = nearest_name(prim, name, known);
        const bool is_ours = name.starts_with("velatura:") &&
                             !name.starts_with("velatura:volume:") && !is_other_name(name);
        if (nearest.empty() && !is_ours) return v;
        const bool is_relation = prim.relationship(name).is_valid();
        const std::string type = prim.type_name().empty() ? "prim" : prim.type_name().str();
        v.code = is_relation ? "unknown-relationship" : "unknown-attribute";
        v.message = fmt::format("{} has no {} {}{}; it is ignored", type,
                                is_relation ? "relationship" : "attribute", name, hint(nearest));
        return v;
    }

    static bool is_other_name(std::string_view name) {
        const auto others = other_names();
        return std::any_of(others.begin(), others.end(),
                           [&](const ExtraName& other) { return other.name == name; });
    }

    /// The name that this one may have been meant for; empty: none, or it is one.
    static std::string nearest_name(Prim prim, const std::string& name, const KnownNames& known) {
        const std::string_view type = prim.type_name().view();
        const bool is_input = name.starts_with("inputs:"), is_output = name.starts_with("outputs:");
        // Interfaces are named as their authors like, and nodes know their inputs themselves
        if ((type == "Material" && (is_input || is_terminal(name))) || type == "NodeGraph")
            return {};
        if (type == "Shader" && (is_output || !knows_inputs(known))) return {};
        if (name.starts_with("primvars:")) return nearest_primvar(name, known);
        if (name.starts_with("collection:")) return nearest_collection(name);
        if (name.starts_with("material:binding:")) return nearest_binding(name);
        // What lights were called before USD 21.02 has a message of its own
        const std::string nearest = nearest_spelling(name, known.names);
        const bool is_old_light = nearest == "inputs:" + name && prim.has_api("LightAPI");
        // `camera` of some pipeline's Scope is not our ray visibility with its namespaces forgotten
        const bool is_others = nearest.starts_with("primvars:velatura:") &&
                               name.find("velatura") == std::string::npos && !prim.is_a("Gprim");
        return is_old_light || is_others ? std::string() : nearest;
    }

    /// Terminals of other renderers: `outputs:mdl:surface`, but not `outputs:mtxl:surface`.
    static bool is_terminal(std::string_view name) {
        const size_t colon = name.rfind(':');
        if (!name.starts_with("outputs:") || name.find(':') == colon) return false;
        const std::string_view what = name.substr(colon + 1);
        if (what != "surface" && what != "displacement" && what != "volume") return false;
        const size_t begin = std::string_view("outputs:").size();
        const std::string renderer(name.substr(begin, colon - begin));
        static const std::array<std::string, 2> ours = {"mtlx", "velatura"};
        return nearest_spelling(renderer, ours).empty();
    }

    static bool knows_inputs(const KnownNames& known) {
        // That of UsdPreviewSurface is warned about where it is read
        return std::any_of(known.attributes.begin(), known.attributes.end(), [](const auto& a) {
            return a.first.starts_with("inputs:") && a.second->schema != "UsdPreviewSurface";
        });
    }

    /// Primvars are named as their authors like: only a letter or two wrong count.
    static std::string nearest_primvar(const std::string& name, const KnownNames& known) {
        if (name.ends_with(":indices")) return {};
        std::string found;
        for (const std::string& other : known.names) {
            if (other == name) return {};
            if (other.starts_with("primvars:") && edit_distance(other, name) <= 2) found = other;
        }
        return found;
    }

    static std::string nearest_collection(const std::string& name) {
        const size_t colon = name.rfind(':');
        if (colon < std::string_view("collection:").size()) return {};
        static const std::vector<std::string> rules = {"includes", "excludes", "includeRoot",
                                                       "expansionRule", "membershipExpression"};
        const std::string nearest = nearest_spelling(name.substr(colon + 1), rules);
        return nearest.empty() ? nearest : name.substr(0, colon + 1) + nearest;
    }

    static std::string nearest_binding(const std::string& name) {
        static const std::string stem = "material:binding:";
        static const std::vector<std::string> purposes = {"full", "preview", "collection"};
        const std::string purpose =
            name.substr(stem.size(), name.find(':', stem.size()) - stem.size());
        const std::string nearest = nearest_spelling(purpose, purposes);
        return nearest.empty() ? nearest
                               : stem + nearest + name.substr(stem.size() + purpose.size());
    }

    void apply(Prim prim, const Token& token, const Verdict& v) {
        const Attribute attribute = prim.attribute(token.view());
        const std::string& name = token.str();
        if (!v.code.empty()) {
            const SourceLoc loc =
                v.code == "unknown-relationship" ? prim.relationship(name).loc() : attribute.loc();
            add(v.code.c_str(), loc, prim.path_string(), v.message);
        }
        if (v.declared && !check_value_type(prim, attribute, *v.declared)) return;
        if (v.unused) check_unused(prim, attribute, v);
        if (v.choice) check_choice(prim, attribute, v);
        if (v.request) check_foreign(prim, attribute, v);
        if (name.starts_with("primvars:") || name == "normals" || name == "widths")
            check_property_metadata(prim, attribute);
    }

    /// At time 0: what changes in time is authored for a reason anyway.
    static std::optional<std::string> authored_text(const Attribute& attribute) {
        return attribute.has_authored_value() ? short_text(attribute.value(0.0)) : std::nullopt;
    }

    /// Whether a value has the shape that the schema declares; warns about others: text for
    /// numbers or the other way round, another number of them. Arrays of numbers, which can be
    /// large, are checked where they are read.
    bool check_value_type(Prim prim,
                          const Attribute& attribute,
                          const usd::stage::SchemaAttribute& declared) {
        const Shape expected = shape_of(declared.type);
        if (expected.kind == Shape::Kind::Other || !attribute.has_authored_value()) return true;
        if (expected.kind == Shape::Kind::Numbers && expected.is_array) return true;
        const std::string_view type = usd::layer::plain_type_name(attribute.value(0.0));
        const Shape found = shape_of(type);
        if (found.kind == Shape::Kind::Other || found == expected) return true;
        add("attribute-type", attribute.loc(), prim.path_string(),
            fmt::format("{} is {}, expected {}; the value is ignored{}", attribute.name().str(),
                        type, declared.type,
                        found.kind == expected.kind && found.kind == Shape::Kind::Numbers
                            ? " or read in part"
                            : ""));
        return false;
    }

    void check_unused(Prim prim, const Attribute& attribute, const Verdict& v) {
        const auto text = authored_text(attribute);
        const auto fallback = attribute.fallback();
        const bool is_neutral = !text || text->empty() || *text == "default" ||
                                (fallback && short_text(*fallback) == *text);
        if (is_neutral) return;
        add("unsupported-attribute", attribute.loc(), prim.path_string(),
            fmt::format("{} of {} is not supported: {}", attribute.name().str(), v.unused->schema,
                        v.unused->consequence));
    }

    void check_choice(Prim prim, const Attribute& attribute, const Verdict& v) {
        const auto text = authored_text(attribute);
        if (!text || is_one_of(*text, v.choice->tokens)) return;
        std::vector<std::string> tokens;
        for (size_t begin = 0; begin <= v.choice->tokens.size();) {
            const size_t end = std::min(v.choice->tokens.find('|', begin), v.choice->tokens.size());
            tokens.emplace_back(v.choice->tokens.substr(begin, end - begin));
            begin = end + 1;
        }
        add("unknown-token", attribute.loc(), prim.path_string(),
            fmt::format("{} is \"{}\", expected {}{}; {}", attribute.name().str(), *text,
                        fmt::join(tokens, ", "), hint(nearest_spelling(*text, tokens)),
                        v.choice->consequence));
    }

    void check_foreign(Prim prim, const Attribute& attribute, const Verdict& v) {
        if (!attribute.has_authored_value()) return;
        const auto text = short_text(attribute.value(0.0));
        if (text && !v.request->neutral.empty() && is_one_of(*text, v.request->neutral)) return;
        add("foreign-attribute", attribute.loc(), prim.path_string(),
            fmt::format("{} of {} is ignored: {}", attribute.name().str(), v.renderer,
                        v.request->what_is_done));
    }

    void check_property_metadata(Prim prim, const Attribute& attribute) {
        for (const std::string& key : attribute.metadata_keys()) {
            const std::string nearest = nearest_spelling(key, property_metadata());
            if (!nearest.empty())
                add("unknown-metadata", attribute.loc(), prim.path_string(),
                    fmt::format("unknown metadata {} of {}{}; it is ignored", key,
                                attribute.name().str(), hint(nearest)));
        }
    }

    /// The order of transform ops against the ops that there are.
    void check_ops(Prim prim, const std::vector<Token>& properties) {
        const Attribute order = prim.attribute("xformOpOrder");
        const auto listed =
            order.get<std::vector<std::string>>().value_or(std::vector<std::string>());
        std::vector<std::string> ops;
        for (const Token& name : properties)
            if (name.view().starts_with("xformOp:")) ops.push_back(name.str());
        std::unordered_set<std::string> used;
        for (const std::string& entry : listed) {
            if (entry == "!resetXformStack!") continue;
            const std::string op = entry.starts_with("!invert!") ? entry.substr(8) : entry;
            used.insert(op);
            if (std::find(ops.begin(), ops.end(), op) != ops.end()) continue;
            if (!usd::stage::is_xform_op(op)) continue;  // said where it is read
            add("missing-xform-op", order.loc(), prim.path_string(),
                fmt::format("xformOpOrder names {}, which the prim does not have{}; the op is "
                            "skipped",
                            op, hint(nearest_spelling(op, ops))));
        }
        for (const std::string& op : ops) {
            if (used.contains(op) || !prim.attribute(op).has_authored_value()) continue;
            add("unused-xform-op", prim.attribute(op).loc(), prim.path_string(),
                fmt::format("{} is not in xformOpOrder: it does not move the prim", op));
        }
    }

    const usd::stage::Stage& stage_;
    std::vector<Finding> findings_;
    std::unordered_map<std::string, size_t> places_;  ///< of findings
    std::unordered_map<std::string, Kind> kinds_;
    std::unordered_set<std::string> prototypes_;
};

}  // namespace

void report_authored_names(const usd::stage::Stage& stage, Diagnostics& diagnostics) {
    NameCheck check(stage);
    check.run();
    check.report(diagnostics);
}

}  // namespace velatura::translate
