// SPDX-License-Identifier: Apache-2.0
#include "film/deep_film.h"

#include "image/exr.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

namespace velatura::film {

namespace {

using DepthKind = SampleRadiance::DepthKind;
using accumulate::Triple;

/// Number of the segment that a depth lies in: each is longer than the last by the same part.
uint64_t segment_of(float depth, float growth) {
    const float positive = std::max(depth, std::numeric_limits<float>::min());
    return uint64_t(int64_t(std::floor(std::log(positive) / std::log1p(growth))));
}

/// Where light comes from that nothing covers: behind everything, and finite for programs that
/// compute with it.
constexpr float background_depth = 1e30f;

float next_after(float v) {
    return std::nextafter(v, std::numeric_limits<float>::infinity());
}

Triple weighted(double weight, const Rgb& c) {
    return {weight * double(c.x), weight * double(c.y), weight * double(c.z)};
}

/// Factor from the sum of the samples to what the file stores.
double ratio(float stored, double sum) {
    return sum > 0.0 ? double(stored) / sum : 1.0;
}

/// `over` from front to back, in float as flat images are made of deep ones.
struct Flat {
    float alpha = 0;

    float left() const { return 1.0f - alpha; }

    float with(float a) const { return alpha + left() * a; }
};

/// The alpha that, laid under `flat`, brings it to `target`. Something is left for what lies
/// behind.
float alpha_to(const Flat& flat, double target, bool is_last) {
    auto a = float(std::clamp((target - double(flat.alpha)) / double(flat.left()), 0.0, 1.0));
    while (!is_last && flat.with(a) >= 1.0f) a = std::nextafter(a, 0.0f);
    return a;
}

}  // namespace

DeepFilm::DeepFilm(const Window& window, const DeepOptions& options)
    : window_(window),
      options_(options),
      pixels_(window.pixel_count()),
      weights_(window.pixel_count(), 0.0) {}

void DeepFilm::add(int x, int y, const SampleRadiance& s) {
    const size_t i = window_.index(x, y);
    const auto weight = double(s.weight);
    weights_[i] += weight;
    const Rgb light = s.radiance();
    const bool is_covered = s.depth_kind != DepthKind::None && std::isfinite(s.depth);
    if (!is_covered && is_black(light)) return;

    Entry added;
    added.weight = weight;
    added.light = weighted(weight, light);
    if (is_covered) {
        added.kind = s.depth_kind;
        added.near = added.far = s.depth;
        added.weighted_depth = weight * double(s.depth);
        added.key = uint64_t(s.instance_id) << 32 | s.prim_id;
        if (s.depth_kind == DepthKind::Volume)
            added.key = segment_of(s.depth, options_.segment_growth);
    }
    std::vector<Entry>& pixel = pixels_[i];
    if (Entry* known = find(pixel, added)) {
        join(*known, added);
        return;
    }
    pixel.push_back(added);
    limit(pixel);
}

void DeepFilm::join(Entry& entry, const Entry& other) {
    entry.near = std::min(entry.near, other.near);
    entry.far = std::max(entry.far, other.far);
    entry.weight += other.weight;
    entry.weighted_depth += other.weighted_depth;
    entry.light += other.light;
}

/// The one that stands for the same, the nearest of several.
DeepFilm::Entry* DeepFilm::find(std::vector<Entry>& pixel, const Entry& added) const {
    Entry* best = nullptr;
    for (Entry& e : pixel) {
        if (e.kind != added.kind || e.key != added.key) continue;
        if (e.kind != DepthKind::Surface) return &e;
        const float near = std::min(e.near, added.near), far = std::max(e.far, added.far);
        if (far - near > options_.surface_tolerance * std::abs(near)) continue;
        const auto distance = [&](const Entry& o) {
            return std::abs(o.depth() - double(added.near));
        };
        if (!best || distance(e) < distance(*best)) best = &e;
    }
    return best;
}

/// Joins the two that are nearest to each other, by the part that depth grows, while there are too
/// many.
void DeepFilm::limit(std::vector<Entry>& pixel) const {
    const auto covers = [](const Entry& e) { return e.kind != DepthKind::None; };
    if (std::count_if(pixel.begin(), pixel.end(), covers) <= options_.max_samples) return;
    // What covers by depth, then the background
    std::stable_sort(pixel.begin(), pixel.end(), [&](const Entry& a, const Entry& b) {
        return covers(a) != covers(b) ? covers(a) : covers(a) && a.depth() < b.depth();
    });
    size_t best = 0;
    double min = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i + 1 < pixel.size() && covers(pixel[i + 1]); ++i) {
        const double growth = (pixel[i + 1].depth() - pixel[i].depth()) / pixel[i].depth();
        if (growth >= min) continue;
        min = growth;
        best = i;
    }
    if (pixel[best].kind == DepthKind::Volume && pixel[best + 1].kind == DepthKind::Surface) {
        pixel[best].kind = DepthKind::Surface;
        pixel[best].key = pixel[best + 1].key;
    }
    join(pixel[best], pixel[best + 1]);
    pixel.erase(pixel.begin() + std::ptrdiff_t(best) + 1);
}

layers::DeepImage DeepFilm::image(const std::vector<float>& rgba) const {
    layers::DeepImage image;
    image.data = image.display = window_;
    for (size_t i = 0; i < pixels_.size(); ++i) {
        const size_t before = image.samples.size();
        lay(pixels_[i], weights_[i], &rgba[4 * i], image.samples);
        image.counts.push_back(uint32_t(image.samples.size() - before));
    }
    return image;
}

/// Shares of the pixel become samples that know nothing of what is before them: a share is what is
/// left there times the sample.
void DeepFilm::lay(std::vector<Entry> pixel,
                   double weight,
                   const float* rgba,
                   std::vector<layers::DeepSample>& out) {
    const auto covers = [](const Entry& e) { return e.kind != DepthKind::None; };
    std::stable_sort(pixel.begin(), pixel.end(), [&](const Entry& a, const Entry& b) {
        if (covers(a) != covers(b)) return covers(a);
        return covers(a) && (a.depth() != b.depth() ? a.depth() < b.depth() : a.key < b.key);
    });
    Triple sum;
    for (const Entry& e : pixel) sum += e.light;
    const double to_r = ratio(rgba[0], sum.x), to_g = ratio(rgba[1], sum.y),
                 to_b = ratio(rgba[2], sum.z);

    Flat flat;
    double covered = 0;
    float back = 0;
    for (size_t i = 0; i < pixel.size(); ++i) {
        const Entry& e = pixel[i];
        layers::DeepSample s;
        const double left = double(flat.left());
        s.r = float(e.light.x * to_r / left);
        s.g = float(e.light.y * to_g / left);
        s.b = float(e.light.z * to_b / left);
        // In order and apart, so that whoever sorts them gets this order, and cuts none in two
        const bool is_segment = e.kind == DepthKind::Volume;
        const float begin = is_segment ? e.near : covers(e) ? float(e.depth()) : background_depth;
        s.z = i == 0 ? begin : std::max(begin, next_after(back));
        const bool has_next = i + 1 < pixel.size() && covers(pixel[i + 1]);
        const float end = has_next ? std::min(e.far, float(pixel[i + 1].depth())) : e.far;
        s.z_back = is_segment ? std::max(s.z, end) : s.z;
        back = s.z_back;
        if (covers(e)) {
            covered += e.weight / weight;
            s.a = alpha_to(flat, covered, i + 1 == pixel.size());
            flat.alpha = flat.with(s.a);
        }
        out.push_back(s);
    }
}

size_t DeepFilm::memory_bytes() const {
    size_t bytes = pixels_.size() * (sizeof(pixels_[0]) + sizeof(weights_[0]));
    for (const auto& pixel : pixels_) bytes += pixel.capacity() * sizeof(Entry);
    return bytes;
}

std::string deep_path(const std::string& image) {
    const std::filesystem::path path(image);
    return (path.parent_path() / (path.stem().string() + ".deep" + path.extension().string()))
        .string();
}

Result<layers::DeepImage> write_deep_image(const DeepFilm& film, const std::string& image) {
    const auto reader = image::ExrReader::open(image);
    if (!reader) return reader.error();
    // Of the first part, which holds all layers where there is one
    const Window& window = reader->header().data;
    std::array<std::vector<float>, 4> planes;
    std::vector<image::RowTarget> targets;
    for (const char* name : {"R", "G", "B", "A"}) {
        std::vector<float>& plane = planes[targets.size()];
        plane.resize(window.pixel_count());
        targets.push_back({name, image::ChannelType::Float, plane.data()});
    }
    if (const auto read = reader->read_rows(0, window.y0, window.y1, targets); !read)
        return read.error();
    std::vector<float> rgba(4 * window.pixel_count());
    for (size_t i = 0; i < rgba.size(); ++i) rgba[i] = planes[i % 4][i / 4];
    layers::DeepImage deep = film.image(rgba);
    deep.display = reader->header().display;
    deep.pixel_aspect_ratio = reader->header().pixel_aspect_ratio;
    for (const auto& [name, attribute] : reader->header().attributes) {
        if (name == "software" || name == "chromaticities" || name == "colorInteropID" ||
            name.starts_with("worldTo") || name == "velatura/scene")
            deep.attributes[name] = attribute;
    }
    nlohmann::ordered_json how;
    how["schema"] = "velatura.deep/1";
    how["surfaceTolerance"] = film.options().surface_tolerance;
    how["segmentGrowth"] = film.options().segment_growth;
    how["mostSamples"] = film.options().max_samples;
    how["picture"] = std::filesystem::path(image).filename().string();
    deep.attributes["velatura/deep"] = how.dump();
    if (const auto written = layers::write_deep_file(deep_path(image), deep); !written)
        return written.error();
    return deep;
}

}  // namespace velatura::film
