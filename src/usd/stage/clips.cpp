// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/clips.h"

#include "usd/layer/fields.h"
#include "usd/stage/value_cast.h"

#include <algorithm>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;

namespace {

/// y at x on the line through two points; exact at the points.
double on_line(double x, double x0, double y0, double x1, double y1) {
    if (x0 == x1 || x == x0) return y0;
    if (x == x1) return y1;
    return (y1 - y0) / (x1 - x0) * (x - x0) + y0;
}

void sort_unique(std::vector<double>& times) {
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
}

/// Time codes in clips are relative to the time they are read at.
Value shifted(const Value& value, double by) {
    return retime_value(value, {by, 1.0});
}

const layer::TimeSamples* samples_of(const layer::Layer& in, Path attribute) {
    const auto* samples = in.field_as<layer::TimeSamples>(attribute, layer::fields().time_samples);
    return samples && !samples->empty() ? samples : nullptr;
}

/// A layer that declares every attribute below `root` that has samples in one of the clips.
compose::LayerPtr make_manifest(const std::vector<const layer::Layer*>& clips, Path root) {
    auto manifest = std::make_shared<layer::Layer>("anonymous:clip-manifest");
    for (const layer::Layer* clip : clips) {
        if (!clip || !clip->has_spec(root)) continue;
        clip->for_each_spec(root, [&](Path path, const layer::Spec& spec) {
            if (spec.kind() != layer::SpecKind::Attribute || !samples_of(*clip, path)) return;
            if (manifest->has_spec(path)) return;
            layer::Spec& declared =
                manifest->create_spec_unlisted(path, layer::SpecKind::Attribute, spec.loc());
            declared.set_field(layer::fields().variability, Value(spec.variability()), spec.loc());
        });
    }
    return manifest;
}

}  // namespace

Value value_of_samples(const layer::TimeSamples& samples, double time) {
    const auto times = samples.times();
    const size_t after = size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin());
    if (after == 0 || after == times.size()) return samples.value(after == 0 ? 0 : after - 1);
    const double lower = times[after - 1];
    const Value before = samples.value(after - 1);
    if (time == lower || !is_interpolable(before)) return before;
    return interpolate(before, samples.value(after), (time - lower) / (times[after] - lower));
}

ClipSet::ClipSet(ClipDefinition definition, ClipLayerOpener open)
    : definition_(std::move(definition)), open_(std::move(open)) {
    for (size_t i = 0; i < definition_.clips.size(); ++i)
        opened_.push_back(std::make_unique<Opened>());
}

bool ClipSet::applies_to(const compose::LayerStack& stack, Path prim) const {
    return &stack == definition_.stack && prim.has_prefix(definition_.source_path);
}

const layer::Layer* ClipSet::clip_layer(size_t clip) const {
    Opened& opened = *opened_[clip];
    std::call_once(opened.once, [&] { opened.layer = open_(definition_.clips[clip].asset); });
    return opened.layer.get();
}

const layer::Layer* ClipSet::manifest_layer() const {
    std::call_once(manifest_.once, [&] {
        if (!definition_.manifest.empty()) {
            manifest_.layer = open_(definition_.manifest);
            return;
        }
        std::vector<const layer::Layer*> clips;
        for (size_t i = 0; i < definition_.clips.size(); ++i) clips.push_back(clip_layer(i));
        manifest_.layer = make_manifest(clips, definition_.clip_path);
    });
    return manifest_.layer.get();
}

Path ClipSet::in_clip(Path attribute) const {
    return attribute.replace_prefix(definition_.source_path, definition_.clip_path);
}

bool ClipSet::has_attribute(Path attribute) const {
    if (definition_.clips.empty()) return false;
    const layer::Layer* manifest = manifest_layer();
    const layer::Spec* declared = manifest ? manifest->spec(in_clip(attribute)) : nullptr;
    return declared && declared->kind() == layer::SpecKind::Attribute &&
           declared->variability() == layer::Variability::Varying;
}

size_t ClipSet::active_clip(double time) const {
    const auto& clips = definition_.clips;
    const auto after = std::upper_bound(clips.begin(), clips.end(), time,
                                        [](double t, const Clip& c) { return t < c.start; });
    return after == clips.begin() ? 0 : size_t(after - clips.begin()) - 1;
}

compose::LayerPtr ClipSet::active_layer(double time) const {
    const size_t i = active_clip(time);
    return clip_layer(i) ? opened_[i]->layer : nullptr;
}

double ClipSet::to_internal(double time) const {
    const auto& times = definition_.times;
    if (times.empty()) return time;
    // The ends of the timing curve hold
    if (time <= times.front().external) return times.front().internal;
    if (time >= times.back().external) return times.back().internal;
    const auto upper =
        std::lower_bound(times.begin(), times.end(), time,
                         [](const ClipTiming& t, double at) { return t.external < at; });
    const ClipTiming& a = *(upper - 1);
    const ClipTiming& b = *upper;
    // Up to a jump the curve runs to the authored time, not to the one just before it
    const double end = b.before_jump ? (upper + 1)->external : b.external;
    return on_line(time, a.external, a.internal, end, b.internal);
}

void ClipSet::add_mapped_times(size_t clip, double internal, std::vector<double>& out) const {
    const auto& times = definition_.times;
    const Clip& range = definition_.clips[clip];
    const auto add = [&](double time) {
        if (time >= range.start && time < range.end) out.push_back(time);
    };
    if (times.empty()) return add(internal);
    for (size_t i = 0; i + 1 < times.size(); ++i) {
        const ClipTiming& a = times[i];
        const ClipTiming& b = times[i + 1];
        if (a.before_jump) continue;
        if (internal < std::min(a.internal, b.internal) ||
            internal > std::max(a.internal, b.internal)) {
            continue;
        }
        if (a.internal == b.internal) {
            add(a.external);
            add(b.external);
            continue;
        }
        // At the near side of a jump the sample is the point just before it
        if (b.before_jump && internal == b.internal) {
            add(b.external);
            continue;
        }
        const double end = b.before_jump ? times[i + 2].external : b.external;
        add(on_line(internal, a.internal, a.external, b.internal, end));
    }
}

const layer::TimeSamples* ClipSet::samples(size_t clip, Path attribute) const {
    const layer::Layer* layer = clip_layer(clip);
    return layer ? samples_of(*layer, in_clip(attribute)) : nullptr;
}

bool ClipSet::contributes(size_t clip, Path attribute) const {
    if (!definition_.interpolate_missing) return true;
    const layer::Layer* manifest = manifest_layer();
    const layer::Spec* declared = manifest ? manifest->spec(in_clip(attribute)) : nullptr;
    if (declared) {
        if (declared->has_field(layer::fields().default_value)) return true;
        // A block in the manifest at a clip's start says that the clip has no samples
        const auto* blocks = declared->field_as<layer::TimeSamples>(layer::fields().time_samples);
        if (blocks && blocks->value_at(definition_.clips[clip].authored_start).is_block())
            return false;
    }
    return samples(clip, attribute) != nullptr;
}

std::vector<double> ClipSet::clip_sample_times(size_t clip, Path attribute) const {
    std::vector<double> times;
    if (const layer::TimeSamples* own = samples(clip, attribute)) {
        for (const double t : own->times()) add_mapped_times(clip, t, times);
    }
    const Clip& range = definition_.clips[clip];
    for (const ClipTiming& point : definition_.times) {
        if (point.external >= range.start && point.external < range.end)
            times.push_back(point.external);
    }
    times.push_back(range.authored_start);
    sort_unique(times);
    return times;
}

std::vector<double> ClipSet::sample_times(Path attribute) const {
    std::vector<double> times;
    for (size_t i = 0; i < definition_.clips.size(); ++i) {
        if (!contributes(i, attribute)) continue;
        const std::vector<double> own = clip_sample_times(i, attribute);
        times.insert(times.end(), own.begin(), own.end());
    }
    if (times.empty() && !definition_.clips.empty())
        times.push_back(definition_.clips.front().authored_start);
    sort_unique(times);
    return times;
}

Value ClipSet::value_at_sample(Path attribute, double time) const {
    const size_t clip = active_clip(time);
    if (const layer::TimeSamples* own = samples(clip, attribute)) {
        const double internal = to_internal(time);
        return shifted(value_of_samples(*own, internal), time - internal);
    }
    // A clip without samples has the manifest's default for its whole range
    const layer::Layer* manifest = manifest_layer();
    const Value* otherwise =
        manifest ? manifest->field(in_clip(attribute), layer::fields().default_value) : nullptr;
    return otherwise ? *otherwise : Value::block();
}

Value ClipSet::value(Path attribute, double time) const {
    const auto& clips = definition_.clips;
    const size_t active = active_clip(time);
    double lower = -no_limit;
    double upper = no_limit;
    if (contributes(active, attribute)) {
        for (const double t : clip_sample_times(active, attribute)) {
            if (t <= time) lower = t;
            if (t >= time) {
                upper = t;
                break;
            }
        }
        // Before the first clip's first time its value holds
        if (lower == -no_limit) lower = upper;
    }
    for (size_t i = active; lower == -no_limit && i-- > 0;) {
        if (contributes(i, attribute)) lower = clip_sample_times(i, attribute).back();
    }
    for (size_t i = active + 1; upper == no_limit && i < clips.size(); ++i) {
        if (contributes(i, attribute)) upper = clips[i].start;
    }
    if (lower == -no_limit) lower = upper;
    if (lower == no_limit) return Value::block();
    const Value before = value_at_sample(attribute, lower);
    if (upper == no_limit || time <= lower || upper <= lower || !is_interpolable(before))
        return time >= upper && upper > lower ? value_at_sample(attribute, upper) : before;
    return interpolate(before, value_at_sample(attribute, upper), (time - lower) / (upper - lower));
}

SourceLoc ClipSet::loc(Path attribute, double time) const {
    const layer::Layer* layer = clip_layer(active_clip(time));
    const layer::Spec* spec = layer ? layer->spec(in_clip(attribute)) : nullptr;
    return spec ? spec->field_loc(layer::fields().time_samples) : SourceLoc{};
}

}  // namespace velatura::usd::stage
