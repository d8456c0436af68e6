// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/resolve.h"

#include "usd/layer/fields.h"
#include "usd/layer/spline.h"
#include "usd/stage/spline_evaluation.h"
#include "usd/stage/value_cast.h"

#include <algorithm>
#include <utility>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

namespace {

using Visit = std::function<bool(const ValueOpinion&)>;

/// The opinions of one spec; false to stop.
bool visit_spec(const PropertySpec& spec, const Visit& visit) {
    const layer::FieldNames& names = layer::fields();
    const auto say = [&](ValueSource source, const layer::Field* field) {
        ValueOpinion opinion;
        opinion.source = source;
        opinion.spec = spec;
        opinion.field = field;
        return visit(opinion);
    };
    if (const layer::Field* samples = spec.spec->find_field(names.time_samples)) {
        const auto* held = samples->value.get_if<layer::TimeSamples>();
        if (held && !held->empty() && !say(ValueSource::TimeSamples, samples)) return false;
    }
    if (const layer::Field* spline = spec.spec->find_field(names.spline)) {
        const auto* held = spline->value.get_if<layer::SplineValue>();
        if (held && !held->knots.empty() && !say(ValueSource::Spline, spline)) return false;
    }
    const layer::Field* value = spec.spec->find_field(names.default_value);
    if (!value || value->value.is_empty()) return true;
    const bool is_block = value->value.is_block() || value->value.is_animation_block();
    return say(is_block ? ValueSource::Blocked : ValueSource::Default, value);
}

bool is_kind_of(const PropertySpec& spec, layer::SpecKind kind) {
    return spec.spec->kind() == kind;
}

/// Sites in strength order, with those that have no specs but are reached by clips.
std::vector<int> sites_with_clips(const PrimData& prim) {
    const auto& nodes = prim.index.nodes();
    std::vector<int> walk;  // in the order of the graph, parents first
    std::vector<int> open = {0};
    while (!open.empty()) {
        const int i = open.back();
        open.pop_back();
        walk.push_back(i);
        std::vector<int> children;
        for (int c = nodes[size_t(i)].first_child; c >= 0; c = nodes[size_t(c)].next_sibling)
            children.push_back(c);
        open.insert(open.end(), children.rbegin(), children.rend());
    }
    std::vector<size_t> place(nodes.size());
    for (size_t i = 0; i < walk.size(); ++i) place[size_t(walk[i])] = i;
    const auto contributing = prim.index.contributing();
    std::vector<int> sites(contributing.begin(), contributing.end());
    for (const int i : walk) {
        const compose::Node& node = nodes[size_t(i)];
        if (node.inert || std::find(sites.begin(), sites.end(), i) != sites.end()) continue;
        const bool is_reached =
            std::any_of(prim.clips->begin(), prim.clips->end(),
                        [&](const auto& set) { return set->applies_to(*node.stack, node.path); });
        if (!is_reached) continue;
        const auto before = std::find_if(sites.begin(), sites.end(), [&](int other) {
            return place[size_t(other)] > place[size_t(i)];
        });
        sites.insert(before, i);
    }
    return sites;
}

bool visit_clips(const compose::Node& node,
                 const compose::StackLayer& layer,
                 const PrimData& prim,
                 Token attribute,
                 const Visit& visit) {
    for (const auto& set : *prim.clips) {
        if (set->definition().anchor != &layer || !set->applies_to(*node.stack, node.path))
            continue;
        const Path path = node.path.append_property(attribute);
        if (!set->has_attribute(path)) continue;
        ValueOpinion opinion;
        opinion.source = ValueSource::Clips;
        opinion.clips = set;
        opinion.clip_attribute = path;
        if (!visit(opinion)) return false;
    }
    return true;
}

void visit_with_clips(const PrimData& prim,
                      Token attribute,
                      const std::vector<PropertySpec>& specs,
                      const Visit& visit) {
    for (const int i : sites_with_clips(prim)) {
        const compose::Node& node = prim.index.nodes()[size_t(i)];
        for (const compose::StackLayer& layer : node.stack->layers()) {
            const auto spec = std::find_if(specs.begin(), specs.end(), [&](const PropertySpec& s) {
                return s.prim_spec->node == i && s.prim_spec->layer == &layer;
            });
            if (spec != specs.end() && !visit_spec(*spec, visit)) return;
            if (!visit_clips(node, layer, prim, attribute, visit)) return;
        }
    }
}

/// A number as the attribute's declared type would hold it.
Value spline_value(double number, const layer::Spec& spec) {
    if (spec.type_name() == "float") return Value(float(number));
    if (spec.type_name() == "half") return Value(layer::Float16(float(number)));
    if (spec.type_name() == "timecode") return Value(layer::TimeCodeValue{number});
    return Value(number);
}

}  // namespace

void visit_value_opinions(const PrimData& prim, Token attribute, const Visit& visit) {
    const std::vector<PropertySpec> specs = property_specs(prim, attribute);
    if (!specs.empty() && !is_kind_of(specs.front(), layer::SpecKind::Attribute)) return;
    if (prim.clips) {
        visit_with_clips(prim, attribute, specs, visit);
        return;
    }
    for (const PropertySpec& spec : specs) {
        if (!visit_spec(spec, visit)) return;
    }
}

bool counts_at(const ValueOpinion& opinion, bool default_time, bool animation_blocked) {
    if (opinion.is_animation_block()) return false;
    if (opinion.source == ValueSource::Default || opinion.source == ValueSource::Blocked)
        return true;
    return !default_time && !animation_blocked;
}

ValueOpinion find_value_opinion(const PrimData& prim, Token attribute, bool default_time) {
    ValueOpinion winner;
    bool animation_blocked = false;
    visit_value_opinions(prim, attribute, [&](const ValueOpinion& opinion) {
        animation_blocked = animation_blocked || opinion.is_animation_block();
        if (!counts_at(opinion, default_time, animation_blocked)) return true;
        winner = opinion;
        return false;
    });
    return winner;
}

Value ValueOpinion::value(TimeCode time) const {
    switch (source) {
        case ValueSource::Default:
            return retime_value(field->value, spec.to_stage);
        case ValueSource::TimeSamples: {
            // Samples live in layer time
            const double t = spec.to_stage.inverse().apply(time.value());
            return retime_value(value_of_samples(*field->value.get_if<layer::TimeSamples>(), t),
                                spec.to_stage);
        }
        case ValueSource::Spline: {
            const double t = spec.to_stage.inverse().apply(time.value());
            const auto number = evaluate_spline(*field->value.get_if<layer::SplineValue>(), t);
            return number ? retime_value(spline_value(*number, *spec.spec), spec.to_stage)
                          : Value::block();
        }
        case ValueSource::Clips:
            return clips->value(clip_attribute, time.value());
        default:
            return Value::block();
    }
}

std::vector<double> ValueOpinion::sample_times() const {
    if (source == ValueSource::Clips) return clips->sample_times(clip_attribute);
    if (source != ValueSource::TimeSamples) return {};
    const auto times = field->value.get_if<layer::TimeSamples>()->times();
    std::vector<double> result(times.begin(), times.end());
    for (double& t : result) t = spec.to_stage.apply(t);
    // A negative scale turns time around
    if (result.size() > 1 && result.front() > result.back())
        std::reverse(result.begin(), result.end());
    return result;
}

SourceLoc ValueOpinion::loc() const {
    if (field) return field->loc;
    return clips ? clips->loc(clip_attribute, clips->definition().clips.front().authored_start)
                 : SourceLoc{};
}

}  // namespace velatura::usd::stage
