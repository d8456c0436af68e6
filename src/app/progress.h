// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "display/terminal_image.h"
#include "statistics/error_curve.h"

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace velatura::app {

enum class ProgressStyle : uint8_t { Bar, Plain, Json, OpenJobDescription, Image, None };

/// "bar" (plain lines when stdout is not a terminal), "json", "openjd", "none"; "kitty", "sixel"
/// and "image" (plain lines when stdout is not a terminal) are Image. Errors: "bad-progress".
Result<ProgressStyle> parse_progress_style(std::string_view text, bool is_terminal);

/// What the progress line shows.
struct ProgressState {
    double fraction = 0;        ///< of the work of this frame, 0…1
    double samples = 0;         ///< per pixel, done
    double samples_target = 0;  ///< 0: time or error ends the render
    double elapsed_s = 0;
    std::optional<double> left_s;  ///< unknown at the very start
    std::optional<double> error;   ///< relative standard error of the image so far
    bool is_upper_error = false;   ///< it is no more than that
    bool is_lower_error = false;   ///< it is no less than that
    std::optional<statistics::ErrorForecast> forecast;
    double rays_per_s = 0;
    size_t memory_bytes = 0;
    bool is_last = false;
};

/// How the terminal of this process takes images, by what it says of itself in the environment;
/// none: it is not known to.
std::optional<display::TerminalProtocol> terminal_protocol();

/// Prints progress to stdout, at most a few times a second on a terminal, every few seconds
/// elsewhere. show() is called by one thread at a time, show_image() by another one.
class ProgressPrinter {
  public:
    explicit ProgressPrinter(ProgressStyle style) : style_(style) {}

    void show(const ProgressState& state);
    /// Of ProgressStyle::Image: prints an image that fits into the terminal in place of the last
    /// one, with the newest progress below it.
    void show_image(display::TerminalProtocol protocol, const display::PreviewImage& image);
    /// Ends the bar's line, so that other output starts on a fresh one.
    void finish_line();

  private:
    ProgressStyle style_;
    std::chrono::steady_clock::time_point last_ = {};
    bool shown_ = false;
    bool line_open_ = false;
    std::mutex mutex_;
    std::string line_;    ///< that stands below an image
    int image_rows_ = 0;  ///< lines of the last one; 0: none yet
};

/// "12.4 s", "3 min 05 s", "2 h 03 min".
std::string format_duration(double seconds);

/// "8 s", "45 s", "1 min 50 s", "2 h 05 min": no more precise than estimates of what is left are.
std::string format_estimate(double seconds);

/// "37.1/64 spp", "213 spp" where there is no target. What adaptive sampling gives beyond the
/// target in the mean is not shown.
std::string format_samples(double samples, double target);

/// "512 MB", "1.4 GB".
std::string format_bytes(size_t bytes);

/// "1 error", "2 errors", "0 errors".
std::string format_count(size_t count, std::string_view noun);

}  // namespace velatura::app
