// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/composer.h"
#include "usd/layer/value.h"

#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace velatura::usd::stage {

struct PrimData;

/// The first clip begins before all times, the last ends after them: -no_limit, no_limit.
inline constexpr double no_limit = std::numeric_limits<double>::infinity();

/// Opens the layer of a clip or manifest by its authored asset path; null when it cannot be read
/// (which is reported once).
using ClipLayerOpener = std::function<compose::LayerPtr(const std::string& asset)>;

/// A point of the timing curve: stage time → time in the clips. Of two entries at one time
/// the first is moved to just before it and marked: no time maps across that jump.
struct ClipTiming {
    double external = 0.0;
    double internal = 0.0;
    bool before_jump = false;
};

/// One layer of a clip set, active in [start, end).
struct Clip {
    std::string asset;
    double authored_start = 0.0;  ///< as authored; the first clip's `start` is -infinity
    double start = 0.0;
    double end = 0.0;
};

/// What the `clips` metadata of one prim comes to for one set name, checked.
struct ClipDefinition {
    std::string name;
    const compose::LayerStack* stack = nullptr;  ///< where the asset paths are authored …
    const compose::StackLayer* anchor = nullptr;
    layer::Path source_path;  ///< … and on which prim
    layer::Path clip_path;    ///< prim inside the clips that stands for source_path
    std::string manifest;     ///< asset path; empty: made from the clips
    bool interpolate_missing = false;
    std::vector<Clip> clips;  ///< ascending
    std::vector<ClipTiming> times;
};

/// Value clips: a sequence of layers that gives time samples to a prim and its descendants.
/// Times outside the clips are stage times. Immutable but for the layers, which are opened on
/// first use; thread-safe.
/// Ref: AOUSD Core Specification 1.0.1, 12.3.4; Pixar's UsdClipsAPI.
class ClipSet {
  public:
    ClipSet(ClipDefinition definition, ClipLayerOpener open);

    const ClipDefinition& definition() const { return definition_; }

    /// True for specs at or below the anchor, in its layer stack.
    bool applies_to(const compose::LayerStack& stack, layer::Path prim) const;

    /// True when the manifest declares the attribute (a path in the anchor's namespace) as varying.
    bool has_attribute(layer::Path attribute) const;

    /// Times at which the set has values, ascending: the clips' samples, the points of the timing
    /// curve, the starts of the clips.
    std::vector<double> sample_times(layer::Path attribute) const;

    /// Value at a time, held or interpolated; a block where there is none.
    layer::Value value(layer::Path attribute, double time) const;

    /// Value at one of sample_times().
    layer::Value value_at_sample(layer::Path attribute, double time) const;

    /// Layer of the clip that is active at a time, for error messages and asset paths; may be null.
    compose::LayerPtr active_layer(double time) const;

    /// Place of the samples that decide the value at a time, or of the attribute.
    SourceLoc loc(layer::Path attribute, double time) const;

  private:
    struct Opened {
        std::once_flag once;
        compose::LayerPtr layer;
    };

    const layer::Layer* clip_layer(size_t clip) const;
    const layer::Layer* manifest_layer() const;
    layer::Path in_clip(layer::Path attribute) const;
    size_t active_clip(double time) const;
    double to_internal(double time) const;
    void add_mapped_times(size_t clip, double internal, std::vector<double>& out) const;
    const layer::TimeSamples* samples(size_t clip, layer::Path attribute) const;
    bool contributes(size_t clip, layer::Path attribute) const;
    std::vector<double> clip_sample_times(size_t clip, layer::Path attribute) const;

    ClipDefinition definition_;
    ClipLayerOpener open_;
    mutable std::vector<std::unique_ptr<Opened>> opened_;
    mutable Opened manifest_;
};

using ClipSets = std::vector<std::shared_ptr<const ClipSet>>;

/// Clip sets whose metadata stands on this prim itself, strongest first. Templates list the files
/// that exist; bad metadata goes to the diagnostics and the set is left out.
std::vector<ClipDefinition> read_clip_definitions(const PrimData& prim,
                                                  const compose::LayerRegistry& registry,
                                                  Diagnostics& diagnostics);

/// Value at a time of one layer's samples, held or interpolated, held outside.
layer::Value value_of_samples(const layer::TimeSamples& samples, double time);

/// Step that is safe to subtract from times up to 10^6: what Pixar moves the near side of a jump
/// by.
inline constexpr double clip_jump_step = 1e6 * 2.220446049250313e-16 * 10.0 * 2.0;

}  // namespace velatura::usd::stage
