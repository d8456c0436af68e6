// SPDX-License-Identifier: Apache-2.0
#include "compositor/inspect/contact_sheet.h"

#include "base/tasks.h"
#include "compositor/inspect/layer_image.h"
#include "layers/layer_header.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>

namespace velatura::compositor::inspect {

using canvas::Canvas;

namespace {

constexpr Canvas::Color background = {0.11f, 0.11f, 0.12f}, bright = {0.92f, 0.92f, 0.92f},
                        dim = {0.6f, 0.62f, 0.66f};
constexpr int gap = 12, smallest_cell = 96, monitor_width = 1920;
constexpr double max_pixels = 64e6;
constexpr int longest_side = 32000;

/// What the header of a file of light layers says of its layers, if it has one.
struct Listing {
    std::vector<std::string> black;
    std::vector<std::string> lit;  ///< light layers: those with a share

    bool is_light(const std::string& name) const {
        return std::find(lit.begin(), lit.end(), name) != lit.end();
    }
};

Listing listing_of(const image::Image& image) {
    Listing listing;
    const auto header = layers::read_layer_header(image);
    if (!header) return listing;
    for (const accumulate::LayerEntry& e : header->layers) {
        if (e.family == "data" || e.family == "halves" || e.name == "rgba") continue;
        (e.is_empty ? listing.black : listing.lit).push_back(e.name);
    }
    return listing;
}

bool is_half(const std::string& name) {
    return name.ends_with("_hA") || name.ends_with("_hB");
}

/// `beauty_hA` is half of `rgba`.
std::string layer_of_half(const std::string& name) {
    const std::string layer = name.substr(0, name.size() - 3);
    return layer == "beauty" ? "rgba" : layer;
}

bool matches(const std::string& name, const std::vector<std::string>& patterns) {
    return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& p) {
        return fnmatch(p.c_str(), name.c_str(), 0) == 0;
    });
}

/// A pattern that fits a half and not its layer as well names halves: `C_*_hA`, not `C_*`.
bool is_wanted(const std::string& name, const SheetOptions& options) {
    const bool shows_all = options.patterns.empty();
    if (!is_half(name)) return shows_all || matches(name, options.patterns);
    const std::string stem = name.substr(0, name.size() - 3);
    const bool names_halves = std::any_of(
        options.patterns.begin(), options.patterns.end(),
        [&](const std::string& p) { return matches(name, {p}) && !matches(stem, {p}); });
    return names_halves ||
           (options.halves && (shows_all || matches(layer_of_half(name), options.patterns)));
}

std::string stops_text(float stops) {
    return fmt::format("{:+.1f} st", stops);
}

/// Where everything goes.
struct Grid {
    int columns = 1, rows = 1, cell_width = 0, cell_height = 0;

    int row_height() const { return gap + Canvas::text_height + 4 + cell_height; }

    int width() const { return gap + columns * (cell_width + gap); }

    int height() const { return rows * row_height() + gap; }
};

Grid grid_of(size_t count,
             const image::Window& frame,
             double pixel_aspect,
             const SheetOptions& options) {
    const double aspect = double(frame.height()) / (double(frame.width()) * pixel_aspect);
    Grid grid;
    for (int width = options.cell_width;; width = width * 4 / 5) {
        grid.cell_width = width;
        grid.cell_height = std::max(1, int(std::lround(width * aspect)));
        const int wide = std::max(1, (monitor_width - gap) / (width + gap));
        // Many layers: about as high as wide
        const int square =
            int(std::ceil(std::sqrt(double(count) * grid.row_height() / (width + gap))));
        grid.columns =
            options.columns > 0 ? options.columns : std::min(int(count), std::max(wide, square));
        grid.rows = int((count + size_t(grid.columns) - 1) / size_t(grid.columns));
        const bool fits = double(grid.width()) * grid.height() <= max_pixels &&
                          std::max(grid.width(), grid.height()) <= longest_side;
        if (fits || width <= smallest_cell) return grid;
    }
}

struct Cell {
    std::string caption, note;
    std::vector<float> rgb;
};

/// Of a beauty that is all but black, or where light and its negative cancel, shares say nothing.
std::string share_note(double share) {
    constexpr double largest = 1e4;
    return std::abs(share) < largest ? fmt::format("{:.1f} %", 100 * share) : std::string("- %");
}

Cell make_cell(const image::Image& image,
               const LayerChannels& layer,
               bool is_light,
               double whole,
               const Grid& grid,
               const SheetOptions& options,
               const image::DisplayTransform& transform) {
    Cell cell;
    cell.caption = layer.name;
    float stops = options.exposure_stops;
    // The header may name as light what has lost channels since
    const bool has_light = layer.kind() == LayerChannels::Kind::Light;
    if (is_light && has_light && whole > 0) cell.note = share_note(mean_luminance(layer) / whole);
    if (options.fit && has_light) {
        stops += fitting_stops(layer);
        cell.note += (cell.note.empty() ? "" : "  ") + stops_text(stops);
    }
    if (const auto range = shown_range(layer))
        cell.note = range->low < range->high
                        ? fmt::format("{:.4g} to {:.4g}", range->low, range->high)
                        : fmt::format("{:.4g}", range->low);
    cell.rgb = thumbnail(image, layer, grid.cell_width, grid.cell_height, stops, transform);
    return cell;
}

/// Names one after the other, as many lines as they need.
std::vector<std::string> lines_of(const std::vector<std::string>& words, int width) {
    std::vector<std::string> lines;
    for (const std::string& word : words) {
        if (!lines.empty() && Canvas::text_width(lines.back() + " " + word) <= width)
            lines.back() += " " + word;
        else
            lines.push_back(word);
    }
    return lines;
}

}  // namespace

Result<Canvas> contact_sheet(const image::Image& image,
                             const SheetOptions& options,
                             std::vector<std::string>* warnings) {
    auto layers = layers_of(image);
    std::erase_if(layers, [&](const LayerChannels& l) { return !is_wanted(l.name, options); });
    if (layers.empty())
        return Error{"no-layers", "no layer to show; `velatura-comp info` lists the layers"};
    const Grid grid =
        grid_of(layers.size(), image.display, double(image.pixel_aspect_ratio), options);
    Listing listing = listing_of(image);
    std::erase_if(listing.black,
                  [&](const std::string& name) { return !is_wanted(name, options); });
    if (!listing.black.empty()) listing.black.front() = "black: " + listing.black.front();
    const auto notes = lines_of(listing.black, grid.width() - 2 * gap);
    const int height = grid.height() + int(notes.size()) * (Canvas::text_height + 6);
    if (double(grid.width()) * height > 2 * max_pixels ||
        std::max(grid.width(), height) > longest_side) {
        return Error{
            "sheet-too-large",
            fmt::format("{} layers do not fit on one sheet; choose some with --layers PATTERN",
                        layers.size())};
    }
    const auto color = image::color_of(image, options.input_space);
    if (!color) return color.error();
    const auto transform = image::DisplayTransform::make(options.display, options.view, *color);
    if (!transform) return transform.error();
    if (warnings) *warnings = transform->warnings();

    const auto beauty = layers_of(image);
    const auto rgba = std::find_if(beauty.begin(), beauty.end(),
                                   [](const LayerChannels& l) { return l.name == "rgba"; });
    const bool has_beauty = rgba != beauty.end() && rgba->kind() == LayerChannels::Kind::Light;
    const double whole = has_beauty ? mean_luminance(*rgba) : 0;
    std::vector<Cell> cells(layers.size());
    parallel_for(layers.size(), [&](size_t i) {
        cells[i] = make_cell(image, layers[i], listing.is_light(layers[i].name), whole, grid,
                             options, *transform);
    });

    Canvas sheet(grid.width(), height, background);
    for (size_t i = 0; i < cells.size(); ++i) {
        const int x = gap + int(i % size_t(grid.columns)) * (grid.cell_width + gap);
        const int y = gap + int(i / size_t(grid.columns)) * grid.row_height();
        const int note_width = cells[i].note.empty() ? 0 : Canvas::text_width(cells[i].note) + 8;
        sheet.write(x, y, grid.cell_width - note_width, cells[i].caption, bright);
        sheet.write(x + grid.cell_width - note_width + 8, y, note_width, cells[i].note, dim);
        sheet.paste(x, y + Canvas::text_height + 4, grid.cell_width, grid.cell_height,
                    cells[i].rgb);
    }
    for (size_t i = 0; i < notes.size(); ++i)
        sheet.write(gap, grid.height() + int(i) * (Canvas::text_height + 6), grid.width() - 2 * gap,
                    notes[i], dim);
    return sheet;
}

}  // namespace velatura::compositor::inspect
