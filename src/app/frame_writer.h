// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/frame_settings.h"
#include "app/memory_needs.h"
#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "integrator/schedule.h"
#include "layers/layer_image.h"
#include "render/renderer.h"
#include "statistics/error_curve.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// Writes what a frame leaves: its file of light layers, interim ones, its deep image, its
/// statistics. All that it is made with must outlive it.
class FrameWriter {
  public:
    FrameWriter(const RenderJob& job,
                const FrameInput& input,
                const render::Renderer& renderer,
                const FrameFacts& facts,
                MemoryWatch& memory)
        : job_(job), input_(input), renderer_(renderer), facts_(facts), memory_(memory) {}

    /// What is written from here on is neither an interim image nor what was stopped.
    void set_finished() { is_finished_ = true; }

    /// broken: effects that ran though the plan has them off. What was rendered for hours is not
    /// lost for some megabytes: a second try takes less memory, and longer.
    Result<layers::WriteReport> write(const statistics::ErrorCurve& curve,
                                      const std::vector<scene::Effect>& broken);

    /// The frame's file under another name.
    Result<layers::WriteReport> write_to(const std::string& path,
                                         const statistics::ErrorCurve& curve,
                                         const std::vector<scene::Effect>& broken) const;

    /// What the frame's file holds, without sums and in several parts. Errors: those of
    /// layers::make_layer_image.
    Result<layers::LayerImage> image(const statistics::ErrorCurve& curve,
                                     const std::vector<scene::Effect>& broken) const;

    /// What is there so far; warns where that cannot be written.
    void write_snapshot(const statistics::ErrorCurve& curve, Diagnostics& diagnostics);

    /// As write(); what cannot be had in its folder after hours is put into that for temporary
    /// files, as one file. Reports where, and sets `code` of exit_codes.h.
    std::optional<layers::WriteReport> write_or_rescue(const statistics::ErrorCurve& curve,
                                                       const std::vector<scene::Effect>& broken,
                                                       int& code,
                                                       Diagnostics& diagnostics);

    /// Of a film that has one; prints it unless quiet. Returns: whether it could be written.
    bool write_deep(Diagnostics& diagnostics) const;

    /// Where they are asked for. Returns: whether they could be written.
    bool write_stats(const MemoryNeeds& needs,
                     const film::NoiseEstimate& noise,
                     const integrator::RenderResult& result,
                     const layers::WriteReport& written,
                     Diagnostics& diagnostics) const;

  private:
    layers::FileInfo file_info(const statistics::ErrorCurve& curve,
                               const std::vector<scene::Effect>& broken) const;
    /// One that there is no memory for is left out: code "memory-limit".
    Result<layers::WriteReport> write_interim(const statistics::ErrorCurve& curve);
    /// Returns: where it is, as part of a message.
    std::string rescue(const statistics::ErrorCurve& curve,
                       const std::vector<scene::Effect>& broken) const;

    const RenderJob& job_;
    const FrameInput& input_;
    const render::Renderer& renderer_;
    const FrameFacts& facts_;
    MemoryWatch& memory_;
    bool is_finished_ = false;
    double write_s_ = 0;  ///< of the image, interim ones included
};

}  // namespace velatura::app
