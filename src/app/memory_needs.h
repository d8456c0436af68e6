// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "base/diagnostics.h"
#include "film/film.h"
#include "shading/texture_cache.h"

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace velatura::app {

/// What a frame that is ready for its first sample will have resident at most, in bytes.
struct MemoryNeeds {
    size_t now = 0;  ///< program, scene and tree, as they are
    size_t film =
        0;  ///< sums of the pixels that are not there yet, of layers that have light everywhere
    size_t splats = 0;    ///< of light tracing, while some passes of it are in use
    size_t writing = 0;   ///< the image as it will be stored, on its way to the file and back
    size_t textures = 0;  ///< tiles, as many as their cache may hold

    size_t total() const { return now + film + splats + writing + textures; }

    /// Of layers that have light in few places, and with a small texture cache.
    size_t min() const;
    /// "1.2 GB: 310 MB program, scene and tree, …", for messages.
    std::string text() const;
};

/// Measures the process and reckons the rest. `film_bytes`: what the film has already.
MemoryNeeds expected_memory(const RenderJob& job,
                            const FrameInput& input,
                            const shading::TextureCache& textures,
                            size_t film_bytes);

/// Under a limit, gives the texture cache what the others leave of it, but not less than what is of
/// use, and adopts its size.
void allot_textures(const shading::TextureCache& textures, MemoryNeeds& needs);

/// What a frame whose scene is built needs; under a limit, the texture cache gets what is left of
/// it. Warns where the limit may end the render early.
MemoryNeeds allot_memory(const RenderJob& job,
                         const FrameInput& input,
                         const shading::TextureCache& textures,
                         size_t film_bytes,
                         Diagnostics& diagnostics);

/// Reports an error where the limit does not suffice for any render. Returns: whether it does.
bool fits_limit(const MemoryNeeds& needs, Diagnostics& diagnostics);

/// Of a render that the limit ended.
void warn_of_memory(const RenderJob& job,
                    const MemoryNeeds& needs,
                    const film::NoiseEstimate& noise,
                    Diagnostics& diagnostics);

/// Looks after the limit while pixels are rendered, which takes memory tile by tile.
class MemoryWatch {
  public:
    /// `reserve`: bytes that are to be left for what comes after the pixels.
    MemoryWatch(const shading::TextureCache& textures, size_t reserve)
        : textures_(textures), reserve_(reserve) {}

    /// Gives up textures, which are read again when they are looked up, when little is left. Called
    /// often, by one thread at a time. Returns: false when that did not help, and the render is to
    /// end with what it has.
    bool keeps_limit();

    /// Whether all that writing may take is there without doubt. A thread of OpenEXR's that finds
    /// no memory may end the process (it copies the message of the exception, which takes memory,
    /// where nobody catches).
    bool has_plenty_to_write() const;

    /// Makes room by what costs time only: for a second try at what memory did not suffice for.
    void make_room();

  private:
    using Clock = std::chrono::steady_clock;

    const shading::TextureCache& textures_;
    size_t reserve_;
    std::optional<Clock::time_point> given_up_;
};

}  // namespace velatura::app
