// SPDX-License-Identifier: Apache-2.0
#include "film/sample_radiance.h"

#include "base/check.h"

#include <cmath>

namespace velatura::film {

namespace {

BadSampleReason fault_of(const Rgb& c) {
    if (std::isnan(c.x) || std::isnan(c.y) || std::isnan(c.z)) return BadSampleReason::NotANumber;
    if (!is_finite(c)) return BadSampleReason::Infinite;
    if (c.x < 0.0f || c.y < 0.0f || c.z < 0.0f) return BadSampleReason::Negative;
    return BadSampleReason::None;
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
      last_bounce_(set.last_bounce),
      matrix_(set.matrix_layers),
      bounces_(set.bounce_layers && !set.matrix_layers),
      groups_(set.group_layers && !set.matrix_layers),
      direct_(table_.direct(0) != image::AccumulatorTable::absent),
      values_(table_.count()),
      is_touched_(table_.count(), 0) {}

void SampleRadiance::deposit(uint32_t accumulator, const Rgb& radiance) {
    if (!is_touched_[accumulator]) {
        is_touched_[accumulator] = 1;
        touched_.push_back(accumulator);
    }
    values_[accumulator] += {double(radiance.x), double(radiance.y), double(radiance.z)};
}

void SampleRadiance::add(int bounce, int group, const Rgb& radiance) {
    VELATURA_DCHECK(bounce >= 0 && group >= 0, "bounce and group count from 0");
    if (const BadSampleReason fault = fault_of(radiance); fault != BadSampleReason::None) {
        mark_bad(fault);
        return;
    }
    if (is_black(radiance)) return;
    const int column = bounce > last_bounce_ ? last_bounce_ + 1 : bounce;
    deposit(image::AccumulatorTable::beauty, radiance);
    if (matrix_) deposit(table_.matrix(column, group), radiance);
    if (bounces_) deposit(table_.bounce(column), radiance);
    if (groups_) deposit(table_.group(group), radiance);
    if (direct_ && bounce == 1) deposit(table_.direct(group), radiance);
}

void SampleRadiance::add_unoccluded(int group, const Rgb& radiance) {
    const uint32_t accumulator = table_.unoccluded(group);
    if (accumulator == image::AccumulatorTable::absent) return;
    if (const BadSampleReason fault = fault_of(radiance); fault != BadSampleReason::None) {
        mark_bad(fault);
        return;
    }
    if (!is_black(radiance)) deposit(accumulator, radiance);
}

Rgb SampleRadiance::radiance() const {
    const image::Triple& v = values_[image::AccumulatorTable::beauty];
    return Rgb(float(v.x), float(v.y), float(v.z));
}

void SampleRadiance::clear() {
    for (const uint32_t accumulator : touched_) {
        values_[accumulator] = {};
        is_touched_[accumulator] = 0;
    }
    touched_.clear();
    bad_ = BadSampleReason::None;
    weight = 1.0f;
    alpha = 0.0f;
    has_hit = false;
    albedo = Rgb(0.0f);
    N = P = Vec3(0.0f);
    Z = 0.0f;
    st = Vec2(0.0f);
    prim_id = instance_id = 0xffffffffu;
}

}  // namespace velatura::film
