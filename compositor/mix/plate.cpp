// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/plate.h"

#include "compositor/io/row_values.h"
#include "compositor/look/stack_color.h"
#include "image/exr.h"
#include "image/file_color.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <variant>

namespace velatura::compositor::mix {

namespace {

using Gain = std::array<float, 3>;

/// A layer of catchers with its gain.
struct CatcherRow {
    std::array<layers::ChannelRef, 3> channels;
    Gain gain = {1, 1, 1};
};

/// How catchers are lit, of every pixel of the data window and channel.
struct CatcherLight {
    std::array<std::vector<float>, 3> lit;    ///< with the gains of the mix
    std::array<std::vector<float>, 3> plain;  ///< as on the plate
};

Error wrong_plate(const std::string& path, const std::string& why) {
    return {"plate", fmt::format("{} {}", path, why)};
}

/// Of the direct light of a group. Whether its bounces have the same goes to `is_same`.
Gain gain_of(const Faders& faders, size_t group, bool& is_same) {
    // Emission is the first of the lobes, where there are some
    const size_t first = faders.lobes.size() > 1 ? 1 : 0;
    const Gain direct = faders.factor(std::min<size_t>(1, faders.bounces.size() - 1), group, first);
    for (size_t column = 1; column < faders.bounces.size(); ++column)
        for (size_t lobe = first; lobe < faders.lobes.size(); ++lobe)
            is_same = is_same && faders.factor(column, group, lobe) == direct;
    return direct;
}

std::optional<CatcherRow> find_row(const LayerStack& layout, const std::string& layer) {
    CatcherRow row;
    size_t found = 0;
    for (const layers::ChannelRef at : layout.data_channels(layer)) {
        const std::string& name = layout.image().parts[at.part].channels[at.channel].name;
        for (size_t c = 0; c < 3; ++c) {
            if (name != layer + "." + "RGB"[c]) continue;
            row.channels[c] = at;
            ++found;
        }
    }
    return found == 3 ? std::optional(row) : std::nullopt;
}

/// The catchers' layers with the gains of their groups; of one group the whole.
std::vector<CatcherRow> rows_of(const LayerStack& layout,
                                const MixPlan& plan,
                                std::vector<std::string>& warnings) {
    std::vector<CatcherRow> rows;
    bool is_same = true;
    for (size_t g = 0; g < plan.faders.groups.size(); ++g) {
        std::optional<CatcherRow> row = find_row(layout, "catcher_" + plan.faders.groups[g].name);
        if (!row) continue;
        row->gain = gain_of(plan.faders, g, is_same);
        rows.push_back(*row);
    }
    if (rows.empty()) {
        if (std::optional<CatcherRow> all = find_row(layout, "catcher")) {
            all->gain = gain_of(plan.faders, 0, is_same);
            rows.push_back(*all);
        }
    }
    if (!rows.empty() && (!is_same || !plan.faders.matted.empty()))
        warnings.push_back(
            "catchers have the gains of direct light, everywhere: those of other bounces and of "
            "mattes do not reach the plate");
    return rows;
}

Result<CatcherLight> read_catchers(const layers::StripReader& file,
                                   const LayerStack& layout,
                                   const std::vector<CatcherRow>& rows,
                                   const CatcherRow& plain,
                                   size_t strip_bytes) {
    std::vector<layers::ChannelRef> wanted(plain.channels.begin(), plain.channels.end());
    for (const CatcherRow& row : rows)
        wanted.insert(wanted.end(), row.channels.begin(), row.channels.end());
    const image::Window& window = layout.image().data;
    const auto width = size_t(window.width());
    CatcherLight light;
    for (size_t c = 0; c < 3; ++c) {
        light.lit[c].assign(window.pixel_count(), 0.0f);
        light.plain[c].assign(window.pixel_count(), 0.0f);
    }
    const auto add = [&](const layers::Strip& strip) {
        std::vector<float> row(width);
        for (size_t y = size_t(strip.y0 - window.y0); y < size_t(strip.y1 - window.y0); ++y) {
            const size_t in_strip = y - size_t(strip.y0 - window.y0);
            for (size_t i = 0; i < wanted.size(); ++i) {
                load_row(strip.channels[i], in_strip * width, width, row.data());
                const size_t c = i % 3;
                const float gain = i < 3 ? 1.0f : rows[i / 3 - 1].gain[c];
                std::vector<float>& to = i < 3 ? light.plain[c] : light.lit[c];
                for (size_t x = 0; x < width; ++x) to[y * width + x] += gain * row[x];
            }
        }
    };
    if (const Result<void> read = file.read(wanted, add, strip_bytes); !read) return read.error();
    return light;
}

void set_value(image::Channel& channel, size_t pixel, float value) {
    if (auto* floats = std::get_if<std::vector<float>>(&channel.data)) {
        (*floats)[pixel] = value;
    } else if (auto* halves = std::get_if<std::vector<Imath::half>>(&channel.data)) {
        const float largest = float(std::numeric_limits<Imath::half>::max());
        (*halves)[pixel] = Imath::half(std::clamp(value, -largest, largest));
    }
}

/// What is left of the plate where catchers stand for it.
float ratio(float lit, float plain) {
    const float r = lit / plain;
    return plain > 0.0f && std::isfinite(r) ? std::max(r, 0.0f) : 1.0f;
}

/// The plate's colors in the numbers of the mix.
Result<image::ColorMatrix> mix_from_plate(const image::Image& plate,
                                          const std::string& path,
                                          const LayerStack& layout,
                                          const Look& look,
                                          std::vector<std::string>& warnings) {
    const Result<image::FileColor> from = image::color_of(plate);
    if (!from) return from.error();
    const Result<image::FileColor> to = color_of_stack(layout, look);
    if (!to) return to.error();
    for (const std::string& warning : from->warnings)
        warnings.push_back(fmt::format("{}: {}", path, warning));
    constexpr image::ColorMatrix same = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (from->space == to->space && from->aces_from_file == to->aces_from_file) return same;
    if (!from->aces_from_file || !to->aces_from_file)
        return wrong_plate(path, fmt::format("has the colors of {}, which cannot be converted into "
                                             "those of the image, {}; convert it to scene-linear "
                                             "EXR of known primaries",
                                             from->label, to->label));
    const auto inverse = image::inverse(*to->aces_from_file);
    if (!inverse) return wrong_plate(path, "is laid under an image whose primaries are none");
    return image::product(*inverse, *from->aces_from_file);
}

}  // namespace

Result<void> lay_on_plate(image::Image& mixed,
                          const layers::StripReader& file,
                          const LayerStack& layout,
                          const MixPlan& plan,
                          const Look& look,
                          const std::string& path,
                          size_t strip_bytes,
                          std::vector<std::string>& warnings) {
    const Result<image::Image> plate = image::read_exr(path);
    if (!plate) return plate.error();
    const auto size_of = [](const image::Window& w) {
        return fmt::format("{} x {}", w.width(), w.height());
    };
    if (plate->display.width() != mixed.display.width() ||
        plate->display.height() != mixed.display.height())
        return wrong_plate(path, fmt::format("is {}, the image {}", size_of(plate->display),
                                             size_of(mixed.display)));
    std::array<const image::Channel*, 3> colors{};
    std::array<image::Channel*, 4> rgba{};
    for (size_t c = 0; c < 4; ++c) {
        const std::string name(1, "RGBA"[c]);
        if (c < 3) colors[c] = plate->find(name);
        for (image::Channel& channel : mixed.parts.at(0).channels)
            if (channel.name == name) rgba[c] = &channel;
    }
    if (!colors[0] || !colors[1] || !colors[2]) return wrong_plate(path, "has no R, G and B");
    if (!rgba[3]) return wrong_plate(path, "needs an image with alpha");
    const auto matrix = mix_from_plate(*plate, path, layout, look, warnings);
    if (!matrix) return matrix.error();

    const std::vector<CatcherRow> rows = rows_of(layout, plan, warnings);
    const std::optional<CatcherRow> plain = find_row(layout, "plate");
    std::optional<CatcherLight> light;
    if (!rows.empty() && plain) {
        Result<CatcherLight> read = read_catchers(file, layout, rows, *plain, strip_bytes);
        if (!read) return read.error();
        light = std::move(*read);
    } else {
        warnings.push_back("the file has no layers of catchers: no shadow falls on the plate");
    }

    const float exposure = std::exp2(look.exposure_stops);
    const image::Window& w = mixed.data;
    size_t shining = 0;  // pixels that cover nothing, and have light of their own
    const int dx = plate->display.x0 - mixed.display.x0, dy = plate->display.y0 - mixed.display.y0;
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            if (!plate->data.contains(x + dx, y + dy)) continue;
            const size_t i = w.index(x, y), p = plate->data.index(x + dx, y + dy);
            std::array<double, 3> photo{};
            for (size_t r = 0; r < 3; ++r)
                for (size_t c = 0; c < 3; ++c)
                    photo[r] += (*matrix)[3 * r + c] * double(colors[c]->value(p));
            const float seen = 1.0f - rgba[3]->value(i);
            shining +=
                size_t(seen == 1.0f && (rgba[0]->value(i) > 0.0f || rgba[1]->value(i) > 0.0f ||
                                        rgba[2]->value(i) > 0.0f));
            for (size_t c = 0; c < 3; ++c) {
                const float lit = light ? ratio(light->lit[c][i], light->plain[c][i]) : 1.0f;
                set_value(*rgba[c], i, rgba[c]->value(i) + float(photo[c]) * exposure * seen * lit);
            }
            set_value(*rgba[3], i, 1.0f);
        }
    }
    if (shining > w.pixel_count() / 10)
        warnings.push_back(fmt::format(
            "{} pixels without alpha have light, which is added to the plate: hide a dome or light "
            "that the plate shows from the camera",
            shining));
    // It is no file of light layers any more
    std::erase_if(mixed.attributes, [](const auto& attribute) {
        return attribute.first.starts_with("velatura/") && attribute.first != "velatura/mix";
    });
    return {};
}

}  // namespace velatura::compositor::mix
