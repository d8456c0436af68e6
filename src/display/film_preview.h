// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "film/film.h"
#include "image/display.h"
#include "image/window.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace velatura::display {

/// A display-referred image, [height][width][3] bytes.
struct PreviewImage {
    int width = 0, height = 0;
    std::vector<uint8_t> rgb;
};

/// The same, not larger than that: means of whole blocks of pixels.
PreviewImage scaled_down(const PreviewImage& image, int max_width, int max_height);

struct PreviewOptions {
    std::string file;       ///< .png, .jpg …, replaced whole at each interval; empty: none
    image::Window display;  ///< the whole image [px]; what lies beside it is not shown
    float pixel_aspect = 1;
    std::chrono::milliseconds interval{5000};
    /// Called with each image, from a thread of its own; empty: not needed.
    std::function<void(const PreviewImage&)> show;
};

/// The beauty of a film while it renders, as an image for people, at intervals.
///
/// Memory:  12 bytes per pixel, twice while an image is made.
/// Threads: add_tile() is called by any thread that owns the tile. Images are made in a thread of
///          its own.
class FilmPreview {
  public:
    FilmPreview(PreviewOptions options, image::DisplayTransform transform);
    /// Ends without another image.
    ~FilmPreview();
    FilmPreview(const FilmPreview&) = delete;
    FilmPreview& operator=(const FilmPreview&) = delete;

    /// Takes the means of the samples so far of a window whose tiles belong to the calling thread.
    void add_tile(const film::Film& film, const image::Window& tile);

    /// Makes the last image, and ends. Errors: those of the last file that was written.
    Result<void> finish();

  private:
    void run();
    void make_image();

    const PreviewOptions options_;
    const image::DisplayTransform transform_;
    std::mutex mutex_;
    std::condition_variable changed_;
    // Under the mutex
    std::vector<float> rgb_;  ///< [height][width][3] of the display
    bool is_new_ = false, is_ending_ = false, is_dropped_ = false;
    Result<void> written_;  ///< of the thread, until it has ended
    std::thread thread_;    ///< last: it uses all of the above
};

}  // namespace velatura::display
