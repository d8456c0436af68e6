// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_sources.h"
#include "base/result.h"
#include "display/tev_connection.h"
#include "display/tev_packets.h"
#include "film/film.h"
#include "image/window.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace velatura::display {

/// What of a film is shown, and where.
struct DisplayOptions {
    Address address;
    std::string name;       ///< of the image in the viewer
    image::Window display;  ///< the whole image [px]; what lies beside it is not shown
    std::vector<accumulate::LayerSource> layers = {};  ///< light layers beside `R G B A`
    std::chrono::milliseconds interval{250};           ///< between two sendings of a tile, at least
};

/// The layers of those names. Errors: "unknown-layer", with the names that there are.
Result<std::vector<accumulate::LayerSource>> find_layers(const film::LayerSet& set,
                                                         const std::vector<std::string>& names);

/// Shows a film in the viewer tev while it renders: scene-linear floats, premultiplied.
///
/// Memory:  4 bytes per pixel and channel.
/// Threads: add_tile() is called by any thread that owns the tile. Sending is done by a thread of
///          its own, which is never waited for but by finish(). A viewer that takes nothing gets
///          what is newest once it does; one that was closed is looked for every 2 seconds and gets
///          the whole image.
class FilmDisplay {
  public:
    explicit FilmDisplay(DisplayOptions options);
    ~FilmDisplay();
    FilmDisplay(const FilmDisplay&) = delete;
    FilmDisplay& operator=(const FilmDisplay&) = delete;

    /// Looks for the viewer, and keeps looking where there is none. Waits a second at most for the
    /// first answer. Errors: "display-unreachable".
    Result<void> start();

    /// Takes the means of the samples so far of a window whose tiles belong to the calling thread.
    void add_tile(const film::Film& film, const image::Window& tile);

    /// Sends what is not sent, for `patience` at most, and ends. Returns: whether all was sent.
    bool finish(std::chrono::milliseconds patience = std::chrono::seconds(3));

  private:
    using Clock = std::chrono::steady_clock;

    struct Tile {
        image::Window window;
        bool is_known = false, is_new = false;
        Clock::time_point sent = {};
    };

    void run();
    bool take_packet();
    void begin_image();

    const DisplayOptions options_;
    std::vector<std::string> channels_;
    TevConnection connection_;
    Bytes packet_;     ///< that is being sent
    size_t sent_ = 0;  ///< of it
    std::mutex mutex_;
    std::condition_variable changed_;
    // Under the mutex
    std::vector<float> values_;  ///< [height][width][channel] of the display
    std::vector<Tile> tiles_;
    std::optional<Result<void>> first_try_;  ///< to reach the viewer
    bool is_ending_ = false;
    Clock::time_point end_ = Clock::time_point::max();
    bool has_all_sent_ = false;
    std::thread thread_;
};

}  // namespace velatura::display
