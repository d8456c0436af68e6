// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "app/frame_settings.h"
#include "base/diagnostics.h"
#include "integrator/schedule.h"
#include "layers/layer_file.h"
#include "layers/top_up.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// How an earlier run rendered, as its file states it.
struct EarlierState {
    std::string build, scene_hash, scene_json;
    uint64_t first_sample = 0;
    std::optional<PartState> part;  ///< nothing: of a top-up
    FrameSettings settings;
    std::string top_ups = "[]";    ///< JSON: by which looks samples were placed
    statistics::ErrorCurve curve;  ///< empty unless it was made for a target
};

/// What an earlier run left of a render.
struct EarlierPart {
    accumulate::SampleSums sums;
    std::vector<layers::BadSample> bad;
    EarlierState state;
};

/// Rates of adaptive sampling that the first part of the render decided on (--rates-from).
struct FirstRates {
    EarlierState state;
    std::string settings_hash;
    std::vector<uint8_t> rates;  ///< [pixel of the data window], in the film's code
};

/// What a frame goes on from.
struct Continuation {
    std::optional<EarlierPart> earlier;           ///< nothing: from the first sample
    std::optional<layers::TopUpRequest> request;  ///< of --for-mix: where samples are added
    std::optional<FirstRates> rates;              ///< of --rates-from
    int code = 0;                                 ///< of exit_codes.h: Done, or why there is none

    /// Settings of a render that goes on from this.
    render::Settings applied_to(render::Settings settings) const;
    /// Why what was decided before the first sample does not fit; empty when it does.
    std::string difference(const FrameSettings& settings,
                           const std::string& settings_hash,
                           const RenderJob& job) const;
    /// What a render that goes on from this, and was not stopped, says of its samples.
    PartState part_of(const RenderJob& job, const integrator::RenderResult& result) const;
    /// The samples that a request asks for, unless --spp says it.
    std::optional<uint64_t> end_sample(const RenderJob& job) const;
};

/// With --resume, reads the output and the request of --for-mix, and the file of --rates-from;
/// reports what does not fit.
Continuation find_continuation(const RenderJob& job,
                               const FrameInput& input,
                               const FrameSettings& settings,
                               Diagnostics& diagnostics);

/// Reads the file that a render is to go on from. Nothing: there is no such file yet. Errors:
/// "resume-refused", with the reason: it is damaged, is no render, holds no sums.
Result<std::optional<EarlierPart>> read_earlier_part(const std::string& path);

/// Reads the file of --rates-from. Errors: "resume-refused", with the reason: it is damaged, is no
/// part of this render, or has no rates.
Result<FirstRates> read_rates(const RenderJob& job,
                              const FrameInput& input,
                              const FrameSettings& settings);

/// Reads the request of --for-mix. Errors: "resume-refused" (made for another render), those of
/// image::read_top_up.
Result<layers::TopUpRequest> read_request(const std::string& path,
                                          const FrameInput& input,
                                          const image::Window& window);

/// The list of looks that samples were placed by, with that of the request behind the others.
std::string with_request(const std::string& top_ups,
                         const layers::TopUpRequest& request,
                         uint64_t samples);

/// Why this is no part of the render of these settings; empty when it is.
std::string difference(const EarlierPart& earlier,
                       const RenderJob& job,
                       const FrameInput& input,
                       const FrameSettings& settings);

/// The same of the settings alone. Those that only the earlier render names are not compared: more
/// become known later.
std::string difference(const EarlierState& earlier, const FrameSettings& settings);

/// Says why; the file stays as it is. Returns: the exit code.
int reject_resume(const std::string& path, const std::string& why, Diagnostics& diagnostics);

}  // namespace velatura::app
