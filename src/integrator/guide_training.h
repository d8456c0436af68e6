// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guiding/guiding_field.h"
#include "integrator/path_tracer.h"

#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>

namespace velatura::integrator {

enum class Guiding : uint8_t {
    Off,
    Auto,  ///< where trial paths say that it pays
    On,
};

/// "off", "auto", "on".
std::optional<Guiding> guiding_mode(std::string_view name);

/// What a training came to. Everything but `seconds` is a function of scene, image size and
/// tracer options alone.
struct GuideTraining {
    guiding::GuidingField field;
    bool is_used = false;  ///< whether to render with the field
    /// Of one camera sample, unguided: variance of its indirect light over the squared image
    /// (relMSE, docs/engineering/numerics.md).
    double trial_variance = 0;
    int wins = 0;  ///< groups of trial paths, of `group_count`, in which guided paths were the more
                   ///< efficient
    RayCounts rays;
    double seconds = 0;

    static constexpr int group_count = 16;
};

/// Learns where light comes from, by paths of its own before the render: three rounds of 1, 2 and 4
/// times a path per four pixels (at least 4096 and at most 65536 paths the first time) over the
/// whole image, whatever part of it will be rendered with how many samples. The last round's
/// field is frozen: the render's random numbers never meet those of the training, so that guided
/// images are unbiased, and they are one image however it is made.
///
/// Auto stops after the first, unguided round where indirect light makes little noise, and
/// otherwise keeps the field only when guided paths were the more efficient ones in most groups of
/// trial paths; cost is counted in rays, not in time. Args: options of the render to come; their
/// `guide` is not looked at. stop: ends the training early, unused.
GuideTraining train_guide(const World& world,
                          const PathTracerOptions& options,
                          Guiding guiding,
                          const std::atomic<bool>* stop = nullptr);

}  // namespace velatura::integrator
