// SPDX-License-Identifier: Apache-2.0
#include "film/sample_radiance.h"

#include "base/check.h"
#include "scene/effect_calls.h"
#include "scene/ids.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::film {

namespace {

/// Of radiance that is not positive or zero.
BadSampleReason fault_of(const Rgb& c) {
    if (std::isnan(c.x) || std::isnan(c.y) || std::isnan(c.z)) return BadSampleReason::NotANumber;
    return BadSampleReason::Negative;
}

/// What is too large is found by its sum.
bool is_sound(const Rgb& c) {
    return c.x >= 0.0f && c.y >= 0.0f && c.z >= 0.0f;
}

accumulate::Triple triple(const Rgb& c) {
    return {double(c.x), double(c.y), double(c.z)};
}

accumulate::Triple product(const accumulate::Triple& a, const accumulate::Triple& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

std::optional<PathLabels> make_labels(const LayerSet& set) {
    if (set.path_layers.empty()) return std::nullopt;
    return PathLabels(
        PathAutomaton::make(set.path_layers, set.has_strict_paths, set.groups).value());
}

}  // namespace

const char* to_string(BadSampleReason reason) {
    switch (reason) {
        case BadSampleReason::None:
            return "none";
        case BadSampleReason::NotANumber:
            return "nan";
        case BadSampleReason::Infinite:
            return "infinite";
        case BadSampleReason::Negative:
            return "negative";
        case BadSampleReason::Other:
            return "other";
    }
    return "other";
}

SampleRadiance::SampleRadiance(const LayerSet& set)
    : table_(set),
      path_layers_(set.path_layers),
      labels_(make_labels(set)),
      last_bounce_(set.last_bounce),
      matrix_(set.matrix_layers && !set.has_lobe_matrix()),
      bounces_(set.bounce_layers && !set.has_cells()),
      groups_(set.group_layers && !set.has_cells()),
      direct_(table_.direct(0) != accumulate::AccumulatorTable::absent),
      clamps_(set.has_clamp()),
      clamp_direct_(set.clamp_direct),
      clamp_indirect_(set.clamp_indirect),
      values_(table_.count()) {
    data.resize(set.named_data.size());
    lobe_of_.assign(path_layers_.size(), scene::none);
    for (uint32_t lobe = 0; const size_t layer : set.lobes()) lobe_of_[layer] = lobe++;
    if (!set.has_catcher_data()) return;
    LayerSet by_groups;
    by_groups.groups = set.groups;
    by_groups.bounce_layers = by_groups.data_layers = false;
    catcher_parts_.assign(2, SampleRadiance(by_groups));
}

void SampleRadiance::begin_catcher() {
    meets_catcher_ = true;
    for (SampleRadiance& part : catcher_parts_) part.clear();
    catcher().has_hit = true;  // its data are not those of the sample
}

Rgb SampleRadiance::radiance_of(int group) const {
    const accumulate::Triple& v = values_[table_.group(group)].sum;
    return Rgb(float(v.x), float(v.y), float(v.z));
}

bool SampleRadiance::fits_floats() const {
    // Weights of few samples may add up to a tenth of their number: image::weight_of()
    constexpr double largest = double(std::numeric_limits<float>::max()) / 16.0;
    const double limit = largest / std::max(1.0, std::abs(double(weight)));
    const auto fits = [&](double v) { return std::abs(v) <= limit; };
    return std::ranges::all_of(touched_, [&](uint32_t accumulator) {
        const accumulate::Triple& sum = values_[accumulator].sum;
        return fits(sum.x) && fits(sum.y) && fits(sum.z);
    });
}

inline void SampleRadiance::deposit(uint32_t accumulator, const accumulate::Triple& radiance) {
    Value& value = values_[accumulator];
    if (!value.is_touched) {
        value.is_touched = true;
        touched_.push_back(accumulator);
    }
    value.sum += radiance;
}

/// Sums are those of a render without clamps; what these take is summed beside them.
inline void SampleRadiance::deposit_light(uint32_t accumulator,
                                          const accumulate::Triple& radiance,
                                          double clamped_share) {
    deposit(accumulator, radiance);
    if (clamped_share == 0.0) return;
    deposit(table_.clamped(accumulator),
            {radiance.x * clamped_share, radiance.y * clamped_share, radiance.z * clamped_share});
}

void SampleRadiance::add(int bounce, int group, const Rgb& radiance, float share) {
    VELATURA_DCHECK(bounce >= 0 && group >= 0, "bounce and group count from 0");
    if (!is_sound(radiance)) {
        mark_bad(fault_of(radiance));
        return;
    }
    if (is_black(radiance)) return;
    using scene::Effect;
    const int column = bounce > last_bounce_ ? last_bounce_ + 1 : bounce;
    const accumulate::Triple value = triple(radiance);
    double clamped = 0.0;
    if (clamps_) {
        const float limit = share * (bounce <= 1 ? clamp_direct_ : clamp_indirect_);
        const float largest = max_component(radiance);
        if (largest > limit) {
            scene::count_call(Effect::ClampLayers);
            clamped = 1.0 - double(limit) / double(largest);
        }
    }
    deposit_light(accumulate::AccumulatorTable::beauty, value, clamped);
    if (matrix_) deposit_light(table_.matrix(column, group), value, clamped);
    if (bounces_) deposit_light(table_.bounce(column), value, clamped);
    if (groups_) deposit_light(table_.group(group), value, clamped);
    if (direct_ && bounce == 1) deposit(table_.direct(group), value);
    if (labels_) deposit_paths(column, group, value, clamped);
}

void SampleRadiance::deposit_paths(int column,
                                   int group,
                                   const accumulate::Triple& v,
                                   double clamped_share) {
    scene::count_call(scene::Effect::PathLayers);
    using Light = accumulate::PathLayer::Light;
    for (const auto& [state, part] : labels_->parts()) {
        for (const uint16_t layer : labels_->automaton().layers_of(state, group)) {
            if (const uint32_t lobe = lobe_of_[layer]; lobe != scene::none) {
                // Emission of a path that scattered is no emission seen directly, and has a lobe
                deposit_light(table_.lobe_matrix(column, group, lobe), product(v, part),
                              clamped_share);
                continue;
            }
            const Light light = path_layers_[layer].light;
            // Clamps leave what is made of light without shadows as it is
            if (light != Light::Unoccluded)
                deposit_light(table_.path(layer), product(v, part),
                              light == Light::Arriving ? clamped_share : 0.0);
        }
    }
}

void SampleRadiance::deposit_unoccluded_paths(int group, const accumulate::Triple& v) {
    for (const auto& [state, part] : labels_->parts()) {
        for (const uint16_t layer : labels_->automaton().layers_of(state, group)) {
            if (path_layers_[layer].light != accumulate::PathLayer::Light::Arriving)
                deposit(table_.unoccluded_path(layer), product(v, part));
        }
    }
}

void SampleRadiance::add_unoccluded(int group, const Rgb& radiance) {
    const uint32_t accumulator = table_.unoccluded(group);
    const bool has_row = accumulator != accumulate::AccumulatorTable::absent;
    const bool has_paths = labels_.has_value();
    if (!has_row && !has_paths) return;
    if (!is_sound(radiance)) {
        mark_bad(fault_of(radiance));
        return;
    }
    if (is_black(radiance)) return;
    if (has_row) deposit(accumulator, triple(radiance));
    if (has_paths) deposit_unoccluded_paths(group, triple(radiance));
}

void SampleRadiance::add_occluded(int group, uint32_t caster, const Rgb& radiance) {
    if (caster == scene::none ||
        table_.taken(group, caster) == accumulate::AccumulatorTable::absent)
        return;
    if (!is_sound(radiance)) {
        mark_bad(fault_of(radiance));
        return;
    }
    if (!is_black(radiance)) deposit(table_.taken(group, caster), triple(radiance));
}

Rgb SampleRadiance::radiance() const {
    const accumulate::Triple& v = values_[accumulate::AccumulatorTable::beauty].sum;
    return Rgb(float(v.x), float(v.y), float(v.z));
}

Rgb SampleRadiance::branch_radiance() const {
    if (!has_branches_) return Rgb(0.0f);
    const accumulate::Triple& v = values_[accumulate::AccumulatorTable::beauty].sum;
    return Rgb(float(v.x - prefix_.x), float(v.y - prefix_.y), float(v.z - prefix_.z));
}

void SampleRadiance::clear() {
    for (const uint32_t accumulator : touched_) values_[accumulator] = {};
    touched_.clear();
    if (labels_) labels_->begin();
    bad_ = BadSampleReason::None;
    has_branches_ = meets_catcher_ = false;
    weight = 1.0f;
    alpha = 0.0f;
    has_hit = false;
    albedo = Rgb(0.0f);
    N = P = Vec3(0.0f);
    Z = 0.0f;
    st = Vec2(0.0f);
    prim_id = instance_id = 0xffffffffu;
    matte_ids = {};
    std::fill(data.begin(), data.end(), accumulate::PickedValue{});
    depth_kind = DepthKind::None;
    depth = 0.0f;
}

}  // namespace velatura::film
