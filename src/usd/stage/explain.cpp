// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/explain.h"

#include "usd/layer/fields.h"
#include "usd/layer/spline.h"
#include "usd/stage/dump.h"
#include "usd/stage/prim_data.h"
#include "usd/stage/resolve.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

namespace {

constexpr size_t longest_value = 72;

std::string shortened(std::string text) {
    if (text.size() <= longest_value) return text;
    size_t end = longest_value - 4;
    // Not inside of a character
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
    return text.substr(0, end) + " ...";
}

std::string value_text(const Value& value) {
    return shortened(value.is_empty() ? "(no value)" : dump_value(value));
}

/// Arcs from the root of the index down to a node.
std::string arc_text(const PrimData& prim, int node) {
    const auto& nodes = prim.index.nodes();
    std::string text;
    for (int i = node; i > 0; i = nodes[size_t(i)].parent) {
        const std::string arc = compose::arc_name(nodes[size_t(i)].arc);
        text = text.empty() ? arc : arc + " > " + text;
    }
    return text.empty() ? "local" : text;
}

ExplainedOpinion opinion_at(const PrimData& prim, const SpecRef& ref, Token property) {
    const compose::Node& node = prim.index.nodes()[size_t(ref.node)];
    ExplainedOpinion opinion;
    opinion.arc = arc_text(prim, ref.node);
    opinion.layer = ref.layer->layer->identifier();
    const Path site = property.empty() ? node.path : node.path.append_property(property);
    opinion.site = site.to_string();
    return opinion;
}

std::string samples_text(const layer::TimeSamples& samples) {
    const auto times = samples.times();
    std::string text = fmt::format("{} samples", times.size());
    if (times.empty()) return text;
    text += fmt::format(", {}: {}", times.front(), dump_value(samples.value(0)));
    if (times.size() > 1)
        text +=
            fmt::format(" ... {}: {}", times.back(), dump_value(samples.value(times.size() - 1)));
    return shortened(text);
}

/// What a value opinion says, before it is known whether it counts.
ExplainedOpinion value_opinion(const PrimData& prim, Token name, const ValueOpinion& said) {
    ExplainedOpinion opinion;
    if (said.spec.prim_spec) opinion = opinion_at(prim, *said.spec.prim_spec, name);
    opinion.loc = said.loc();
    switch (said.source) {
        case ValueSource::TimeSamples:
            opinion.what = "time samples";
            opinion.value = samples_text(*said.field->value.get_if<layer::TimeSamples>());
            break;
        case ValueSource::Spline:
            opinion.what = "spline";
            opinion.value = fmt::format(
                "{} knots", said.field->value.get_if<layer::SplineValue>()->knots.size());
            break;
        case ValueSource::Clips: {
            const ClipDefinition& set = said.clips->definition();
            opinion.what = fmt::format("clips \"{}\"", set.name);
            opinion.arc = "value clips";
            opinion.layer = set.anchor->layer->identifier();
            opinion.site = said.clip_attribute.to_string();
            opinion.value =
                fmt::format("{} clips from @{}@ on", set.clips.size(), set.clips.front().asset);
            break;
        }
        default:
            opinion.what = said.is_animation_block() ? "animation block" : "default";
            opinion.value = value_text(said.field->value);
    }
    const layer::LayerOffset& offset = said.spec.to_stage;
    if (!offset.is_identity())
        opinion.note = fmt::format("stage time = {} * time + {}", offset.scale, offset.offset);
    return opinion;
}

void add_note(ExplainedOpinion& opinion, const std::string& note) {
    opinion.note += opinion.note.empty() ? note : "; " + note;
}

std::string time_text(TimeCode time) {
    return time.is_default() ? "the default time" : fmt::format("time {}", time.value());
}

std::string paths_text(const std::vector<Path>& paths) {
    std::string text = "[";
    for (const Path& path : paths)
        text += (text.size() > 1 ? ", " : "") + std::string("<") + path.to_string() + ">";
    return text + "]";
}

/// Opinions of the specs of a prim or property on one field.
void add_field_opinions(const Prim& prim, Token property, Token field, Explanation& result) {
    const PrimData& data = *prim.data();
    const auto add = [&](const SpecRef& ref, const layer::Spec& spec) {
        const layer::Field* said = spec.find_field(field);
        if (!said) return;
        ExplainedOpinion opinion = opinion_at(data, ref, property);
        opinion.what = field.str();
        opinion.loc = said->loc;
        opinion.value = value_text(said->value);
        opinion.decides = result.opinions.empty();
        result.opinions.push_back(std::move(opinion));
    };
    if (property.empty()) {
        for (const SpecRef& ref : data.specs) add(ref, *ref.spec);
    } else {
        for (const PropertySpec& spec : property_specs(data, property))
            add(*spec.prim_spec, *spec.spec);
    }
}

/// Adds who says what about an attribute's connections; all of them take part.
void add_connections(const Attribute& attribute, Explanation& result) {
    const size_t values = result.opinions.size();
    add_field_opinions(attribute.prim(), attribute.name(), layer::fields().connection_paths,
                       result);
    if (result.opinions.size() == values) return;
    for (size_t i = values; i < result.opinions.size(); ++i) result.opinions[i].decides = true;
    result.result += ", connected to " + shortened(paths_text(attribute.connections()));
    result.reason += "; list edits of connections are applied from the weakest opinion up";
}

Explanation explain_attribute(const Attribute& attribute, TimeCode time) {
    const PrimData& prim = *attribute.prim().data();
    const bool at_default = time.is_default();
    Explanation result;
    result.subject =
        fmt::format("{} {}{}", attribute.path_string(), attribute.is_uniform() ? "uniform " : "",
                    attribute.type_name().str());
    result.result = value_text(attribute.value(time));
    bool animation_blocked = false;
    bool decided = false;
    ValueOpinion winner;
    visit_value_opinions(prim, attribute.name(), [&](const ValueOpinion& said) {
        ExplainedOpinion opinion = value_opinion(prim, attribute.name(), said);
        animation_blocked = animation_blocked || said.is_animation_block();
        if (decided) {
            add_note(opinion, "weaker");
        } else if (said.is_animation_block()) {
            add_note(opinion, "hides weaker time samples and splines");
        } else if (!counts_at(said, at_default, animation_blocked)) {
            add_note(opinion, animation_blocked ? "hidden by an animation block"
                                                : "ignored at the default time");
        } else {
            opinion.decides = decided = true;
            winner = said;
        }
        result.opinions.push_back(std::move(opinion));
        return true;
    });
    const auto fallback = attribute.fallback();
    if (fallback) {
        ExplainedOpinion opinion;
        opinion.what = "fallback";
        opinion.arc = "schema";
        opinion.value = value_text(*fallback);
        const bool is_blocked = winner.source == ValueSource::Blocked;
        opinion.decides = !decided || is_blocked;
        if (decided && !is_blocked) add_note(opinion, "weaker");
        result.opinions.push_back(std::move(opinion));
    }
    switch (winner.source) {
        case ValueSource::None:
            result.reason = fallback ? "no effective opinion is authored: the schema's fallback"
                                     : "no effective opinion is authored";
            break;
        case ValueSource::Blocked:
            result.reason = fallback ? "the strongest opinion is None: the schema's fallback"
                                     : "the strongest opinion is None: no value";
            break;
        default:
            result.reason =
                fmt::format("{} of the strongest effective opinion at {}",
                            value_opinion(prim, attribute.name(), winner).what, time_text(time));
    }
    add_connections(attribute, result);
    return result;
}

/// List-ops and dictionaries: every opinion takes part.
void mark_combined(Explanation& result, const Value& strongest) {
    const bool is_dictionary = strongest.get_if<layer::Dictionary>() != nullptr;
    const bool is_list = strongest.type() >= layer::ValueType::TokenListOp &&
                         strongest.type() <= layer::ValueType::UnregisteredListOp;
    if (!is_dictionary && !is_list) {
        result.reason = "the strongest opinion";
        return;
    }
    result.reason = is_dictionary ? "dictionaries are merged, entries of stronger opinions first"
                                  : "list edits are applied from the weakest opinion up";
    for (ExplainedOpinion& opinion : result.opinions) opinion.decides = true;
}

Explanation explain_relationship(const Relationship& relationship) {
    Explanation result;
    result.subject = relationship.path_string() + " rel";
    result.result = shortened(paths_text(relationship.targets()));
    add_field_opinions(relationship.prim(), relationship.name(), layer::fields().target_paths,
                       result);
    for (ExplainedOpinion& opinion : result.opinions) opinion.decides = true;
    result.reason = result.opinions.empty() ? "no targets are authored"
                                            : "list edits are applied from the weakest opinion up";
    return result;
}

Explanation explain_prim(const Prim& prim) {
    Explanation result;
    result.subject = fmt::format("{} {}", prim.path_string(), prim.type_name().str());
    result.result = fmt::format(
        "{}{}{}{}{}", prim.is_defined() ? "defined" : "over", prim.is_active() ? "" : ", inactive",
        prim.is_abstract() ? ", abstract" : "", prim.is_loaded() ? "" : ", not loaded",
        prim.is_instance()         ? ", instance"
        : prim.is_instance_proxy() ? ", below an instance"
                                   : "");
    for (const auto& selection : prim.variant_selections())
        result.result += fmt::format(", {} = \"{}\"", selection.first, selection.second);
    result.reason = "sites, strongest first";
    for (const SpecRef& ref : prim.data()->specs) {
        ExplainedOpinion opinion = opinion_at(*prim.data(), ref, Token());
        opinion.what = "spec";
        opinion.loc = ref.spec->loc();
        const layer::Specifier said = ref.spec->specifier();
        opinion.value = said == layer::Specifier::Def     ? "def"
                        : said == layer::Specifier::Class ? "class"
                                                          : "over";
        if (!ref.spec->type_name().empty()) opinion.value += " " + ref.spec->type_name().str();
        result.opinions.push_back(std::move(opinion));
    }
    return result;
}

Explanation explain_metadata(const Prim& prim, Token property, const std::string& key) {
    Explanation result;
    result.subject =
        prim.path_string() + (property.empty() ? "" : "." + property.str()) + " " + key;
    add_field_opinions(prim, property, Token(key), result);
    const auto value =
        property.empty() ? prim.metadata(key) : prim.attribute(property.view()).metadata(key);
    result.result = value ? value_text(*value) : "(no value)";
    if (value) {
        mark_combined(result, *value);
    } else {
        result.reason = "nothing is authored";
    }
    return result;
}

Explanation explain_stage_metadata(const Stage& stage, const std::string& key) {
    Explanation result;
    result.subject = "/ " + key;
    const auto value = stage.metadata(key);
    result.result = value ? value_text(*value) : "(no value)";
    for (const layer::Layer* layer : stage.impl().root_layers()) {
        const layer::Field* field = layer->pseudo_root().find_field(Token(key));
        if (!field) continue;
        ExplainedOpinion opinion;
        opinion.what = key;
        opinion.arc = "local";
        opinion.layer = layer->identifier();
        opinion.site = "/";
        opinion.loc = field->loc;
        opinion.value = value_text(field->value);
        opinion.decides = result.opinions.empty();
        result.opinions.push_back(std::move(opinion));
    }
    if (value) {
        mark_combined(result, *value);
    } else {
        result.reason = "nothing is authored in the session layer or the root layer";
    }
    return result;
}

Error unknown(std::string_view object) {
    return {"unknown-object", fmt::format("prim or property <{}> not found", object)};
}

}  // namespace

Result<Explanation> explain(const Stage& stage, std::string_view object, TimeCode time) {
    const size_t hash = object.find('#');
    const std::string key(hash == std::string_view::npos ? "" : object.substr(hash + 1));
    const Path path = Path::from(object.substr(0, hash));
    if (path.is_empty()) return unknown(object);
    const Prim prim = stage.prim_at(path.prim_path());
    if (!prim) return unknown(object);
    if (prim.is_pseudo_root() && !key.empty()) return explain_stage_metadata(stage, key);
    const bool is_list_of_paths = key == layer::fields().target_paths.view() ||
                                  key == layer::fields().connection_paths.view();
    if (is_composition_field(Token(key))) {
        return Error{"unknown-object",
                     fmt::format("{} is composition, not metadata; use --explain <{}>", key,
                                 path.prim_path().to_string())};
    }
    if (!path.is_property())
        return key.empty() ? explain_prim(prim) : explain_metadata(prim, Token(), key);
    const Attribute attribute = prim.attribute(path.name().view());
    const Relationship relationship = prim.relationship(path.name().view());
    if (!attribute && !relationship) return unknown(object);
    if (!key.empty() && !is_list_of_paths) return explain_metadata(prim, path.name(), key);
    return relationship ? explain_relationship(relationship) : explain_attribute(attribute, time);
}

std::string explanation_text(const Explanation& explanation, const Diagnostics& diagnostics) {
    std::string text = fmt::format("{}\n  = {}\n  {}\n", explanation.subject, explanation.result,
                                   explanation.reason);
    size_t number = 0;
    for (const ExplainedOpinion& opinion : explanation.opinions) {
        const std::string file =
            opinion.loc.is_known() ? diagnostics.file_name(opinion.loc.file_id) : opinion.layer;
        std::string place = file;
        if (opinion.loc.line > 0)
            place += fmt::format(":{}:{}", opinion.loc.line, opinion.loc.column);
        text += fmt::format("{} {:2} {}: {} = {}\n", opinion.decides ? "*" : " ", ++number,
                            place.empty() ? "schema" : place, opinion.what, opinion.value);
        if (!opinion.site.empty())
            text += fmt::format("       {} <{}>\n", opinion.arc, opinion.site);
        if (!opinion.note.empty()) text += fmt::format("       {}\n", opinion.note);
    }
    return text;
}

}  // namespace velatura::usd::stage
