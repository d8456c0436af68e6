// SPDX-License-Identifier: Apache-2.0
#include "app/progress.h"

#include "app/accuracy.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace velatura::app {

Result<ProgressStyle> parse_progress_style(std::string_view text, bool is_terminal) {
    if (text == "bar") return is_terminal ? ProgressStyle::Bar : ProgressStyle::Plain;
    if (text == "json") return ProgressStyle::Json;
    if (text == "openjd") return ProgressStyle::OpenJobDescription;
    if (text == "none") return ProgressStyle::None;
    if (text == "kitty" || text == "sixel") return ProgressStyle::Image;
    if (text == "image") return is_terminal ? ProgressStyle::Image : ProgressStyle::Plain;
    return Error{
        "bad-progress",
        fmt::format(
            "unknown progress style \"{}\": expected bar, json, openjd, image, kitty, sixel "
            "or none",
            text)};
}

std::optional<display::TerminalProtocol> terminal_protocol() {
    const auto value = [](const char* name) {
        const char* const text = std::getenv(name);
        return std::string(text ? text : "");
    };
    const std::string term = value("TERM"), program = value("TERM_PROGRAM");
    // Not KITTY_WINDOW_ID: tmux, and any terminal that was started there, has it, too
    if (term.find("kitty") != std::string::npos || term.find("ghostty") != std::string::npos ||
        program == "ghostty" || program == "WezTerm")
        return display::TerminalProtocol::Kitty;
    for (const char* known : {"foot", "mlterm", "contour", "yaft", "sixel"})
        if (term.find(known) != std::string::npos) return display::TerminalProtocol::Sixel;
    if (program == "iTerm.app" || program == "mintty") return display::TerminalProtocol::Sixel;
    return std::nullopt;
}

std::string format_duration(double seconds) {
    if (seconds < 60.0) return fmt::format("{:.1f} s", seconds);
    const auto whole = uint64_t(std::llround(seconds));
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string format_estimate(double seconds) {
    struct Step {
        double below, unit;
    };

    constexpr Step steps[] = {{20, 1}, {120, 5}, {600, 10}, {3600, 60}};
    double unit = 300;
    for (const Step& step : steps) {
        if (seconds >= step.below) continue;
        unit = step.unit;
        break;
    }
    const double rounded = std::round(std::max(seconds, 0.0) / unit) * unit;
    return rounded < 60 ? fmt::format("{:.0f} s", rounded) : format_duration(rounded);
}

std::string format_samples(double samples, double target) {
    const double shown = target > 0 ? std::min(samples, target) : samples;
    const std::string text =
        shown < 100.0 ? fmt::format("{:.3g}", shown) : fmt::format("{:.0f}", shown);
    return target > 0 ? fmt::format("{}/{:.0f} spp", text, target) : text + " spp";
}

std::string format_bytes(size_t bytes) {
    const double megabytes = double(bytes) / 1e6;
    return megabytes < 1000.0 ? fmt::format("{:.0f} MB", megabytes)
                              : fmt::format("{:.1f} GB", megabytes / 1000.0);
}

std::string format_count(size_t count, std::string_view noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

namespace {

std::string summary(const ProgressState& s) {
    std::string line =
        fmt::format("{:5.1f} %  {}  {}", s.fraction * 100.0,
                    format_samples(s.samples, s.samples_target), format_duration(s.elapsed_s));
    if (s.left_s) line += fmt::format(" | {} left", format_estimate(*s.left_s));
    if (s.error)
        line += fmt::format("  error {}{:.2f} %",
                            s.is_lower_error   ? "> "
                            : s.is_upper_error ? "< "
                                               : "",
                            *s.error * 100.0);
    if (s.forecast) line += fmt::format(" ({})", short_forecast(*s.forecast));
    line += fmt::format("  {:.2f} Mray/s  {}", s.rays_per_s / 1e6, format_bytes(s.memory_bytes));
    return line;
}

std::string json_line(const ProgressState& s) {
    nlohmann::ordered_json j;
    j["percent"] = s.fraction * 100.0;
    j["spp"] = s.samples;
    j["spp_target"] = s.samples_target > 0 ? nlohmann::ordered_json(s.samples_target)
                                           : nlohmann::ordered_json(nullptr);
    j["elapsed_s"] = s.elapsed_s;
    j["left_s"] = s.left_s ? nlohmann::ordered_json(*s.left_s) : nlohmann::ordered_json(nullptr);
    j["error"] = s.error ? nlohmann::ordered_json(*s.error) : nlohmann::ordered_json(nullptr);
    if (s.forecast) j["forecast"] = forecast_json(*s.forecast);
    j["rays_per_s"] = s.rays_per_s;
    j["memory_bytes"] = s.memory_bytes;
    return j.dump();
}

std::string bar(double fraction) {
    constexpr int cells = 24;
    const int full = std::clamp(int(fraction * cells), 0, cells);
    return "[" + std::string(size_t(full), '#') + std::string(size_t(cells - full), '.') + "] ";
}

}  // namespace

void ProgressPrinter::show(const ProgressState& s) {
    if (style_ == ProgressStyle::None) return;
    const auto now = std::chrono::steady_clock::now();
    const double pause_s = style_ == ProgressStyle::Bar ? 0.1 : 2.0;
    if (shown_ && !s.is_last && std::chrono::duration<double>(now - last_).count() < pause_s)
        return;
    last_ = now;
    shown_ = true;
    switch (style_) {
        case ProgressStyle::Bar:
            fmt::print("\r{}{}\033[K", bar(s.fraction), summary(s));
            line_open_ = true;
            if (s.is_last) finish_line();
            break;
        case ProgressStyle::Plain:
            fmt::print("{}\n", summary(s));
            break;
        case ProgressStyle::Json:
            fmt::print("{}\n", json_line(s));
            break;
        case ProgressStyle::OpenJobDescription:
            fmt::print("openjd_progress: {:.1f}\nopenjd_status: {}\n", s.fraction * 100.0,
                       summary(s));
            break;
        case ProgressStyle::Image: {
            const std::lock_guard lock(mutex_);
            line_ = summary(s);
            if (s.is_last) fmt::print("{}\n", line_);
            break;
        }
        case ProgressStyle::None:
            break;
    }
    std::fflush(stdout);
}

void ProgressPrinter::show_image(display::TerminalProtocol protocol,
                                 const display::PreviewImage& image) {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) size = {};
    // What a terminal that does not say is taken for
    const int rows = size.ws_row > 0 ? size.ws_row : 40,
              columns = size.ws_col > 0 ? size.ws_col : 80;
    const int cell_width = size.ws_xpixel > 0 ? size.ws_xpixel / columns : 8,
              cell_height = size.ws_ypixel > 0 ? size.ws_ypixel / rows : 16;
    constexpr int most_width = 960, rows_of_others = 3;
    const display::PreviewImage shown =
        display::scaled_down(image, std::min(columns * cell_width, most_width),
                             std::max(rows - rows_of_others, 1) * std::max(cell_height, 1));
    const std::lock_guard lock(mutex_);
    std::string out;
    if (image_rows_ > 0) out = fmt::format("\033[{}A\r\033[J", image_rows_);
    out += display::terminal_image(protocol, shown);
    // A line that wraps would move the next image
    out += line_.substr(0, size_t(columns - 1)) + "\033[K\n";
    image_rows_ = (shown.height + cell_height - 1) / std::max(cell_height, 1) + 1;
    std::fwrite(out.data(), 1, out.size(), stdout);
    std::fflush(stdout);
}

void ProgressPrinter::finish_line() {
    if (!line_open_) return;
    fmt::print("\n");
    std::fflush(stdout);
    line_open_ = false;
}

}  // namespace velatura::app
