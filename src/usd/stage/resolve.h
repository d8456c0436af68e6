// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/stage/clips.h"
#include "usd/stage/prim_data.h"

#include <functional>
#include <memory>
#include <vector>

namespace velatura::usd::stage {

/// One say on an attribute's value. Blocked stands for `None` and for animation blocks, which end
/// only samples and splines.
struct ValueOpinion {
    ValueSource source = ValueSource::None;
    PropertySpec spec;                     ///< `spec.spec` is null for clips
    const layer::Field* field = nullptr;   ///< null for clips
    std::shared_ptr<const ClipSet> clips;  ///< of a Clips opinion …
    layer::Path clip_attribute;            ///< … and the attribute in the anchor's namespace

    bool is_animation_block() const { return field && field->value.is_animation_block(); }

    /// The value at a time (stage time; default for Default); a block where there is none.
    layer::Value value(TimeCode time) const;
    /// Times of samples, in stage time; empty for what is not sampled.
    std::vector<double> sample_times() const;
    SourceLoc loc() const;
};

/// Every say on an attribute's value, strongest first; `visit` returns false to stop.
/// Within a layer: time samples, spline, default, then the clip sets that are anchored there.
void visit_value_opinions(const PrimData& prim,
                          layer::Token attribute,
                          const std::function<bool(const ValueOpinion&)>& visit);

/// The opinion that decides. At the default time only defaults count; at other times the first
/// opinion wins, whatever kind it is. A source of None when there is none.
/// Ref: AOUSD Core Specification 1.0.1, 12.3.
ValueOpinion find_value_opinion(const PrimData& prim, layer::Token attribute, bool default_time);

/// True when an opinion counts for a query at the default time, or at a time.
bool counts_at(const ValueOpinion& opinion, bool default_time, bool animation_blocked);

}  // namespace velatura::usd::stage
