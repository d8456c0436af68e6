// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge_deep.h"

#include "image/window_bounds.h"
#include "layers/deep_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>

namespace velatura::compositor {
inline namespace io {

namespace {

constexpr const char* how_attribute = "velatura/deep";

Error refused(const std::string& why) {
    return {"merge-refused", why};
}

struct DeepPart {
    std::string path;
    layers::DeepImage image;
    std::vector<uint64_t> first;  ///< index of the first sample of every pixel
};

/// velatura/deep, without the name of the flat image beside it.
nlohmann::ordered_json how_of(const layers::DeepImage& image) {
    const auto at = image.attributes.find(how_attribute);
    const std::string* const text =
        at == image.attributes.end() ? nullptr : std::get_if<std::string>(&at->second);
    auto how = nlohmann::ordered_json::parse(text ? *text : "", nullptr, false);
    if (how.is_object()) how.erase("picture");
    return how;
}

/// How two deep images cannot be of one render; empty if they can.
std::string difference(const layers::DeepImage& a, const layers::DeepImage& b) {
    if (a.display != b.display || a.pixel_aspect_ratio != b.pixel_aspect_ratio)
        return "are of images with different sizes";
    if (how_of(a) != how_of(b)) return "gather their deep samples differently";
    image::Attributes of_a = a.attributes, of_b = b.attributes;
    of_a.erase(how_attribute), of_b.erase(how_attribute);
    for (const auto& [name, value] : of_a)
        if (!of_b.contains(name) || of_b[name] != value)
            return fmt::format("differ in {} of their headers", name);
    if (of_a.size() != of_b.size()) return "differ in their headers";
    return {};
}

Result<DeepPart> read_part(const std::string& path) {
    Result<layers::DeepImage> image = layers::read_deep_file(path);
    if (!image) return image.error();
    DeepPart part = {path, std::move(*image), {}};
    part.first.reserve(part.image.counts.size());
    uint64_t sum = 0;
    for (const uint32_t count : part.image.counts) {
        part.first.push_back(sum);
        sum += count;
    }
    return part;
}

/// For each pixel the part that has it. Errors: "merge-refused".
Result<std::vector<uint32_t>> owners_of(const std::vector<DeepPart>& parts,
                                        const image::Window& all) {
    constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
    std::vector<uint32_t> owners(all.pixel_count(), none);
    for (uint32_t i = 0; i < parts.size(); ++i) {
        const image::Window& w = parts[i].image.data;
        for (int y = w.y0; y < w.y1; ++y) {
            for (int x = w.x0; x < w.x1; ++x) {
                uint32_t& owner = owners[all.index(x, y)];
                if (owner != none)
                    return refused(fmt::format("overlap: {} and {} both have the pixel {},{}",
                                               parts[owner].path, parts[i].path, x, y));
                owner = i;
            }
        }
    }
    const auto gap = std::find(owners.begin(), owners.end(), none);
    if (gap == owners.end()) return owners;
    const auto place = size_t(gap - owners.begin()), width = size_t(all.width());
    return refused(fmt::format("gap: no file has {} pixels, {},{} among them",
                               std::count(gap, owners.end(), none), all.x0 + int(place % width),
                               all.y0 + int(place / width)));
}

/// The name of the flat image beside a deep one: shot.exr of shot.deep.exr.
std::string picture_of(const std::string& deep) {
    const std::filesystem::path path(deep);
    const std::filesystem::path stem = path.stem();
    return stem.extension() == ".deep" ? stem.stem().string() + path.extension().string() : "";
}

}  // namespace

Result<void> merge_deep_files(const std::vector<std::string>& inputs, const std::string& output) {
    std::vector<DeepPart> parts;
    for (const std::string& path : inputs) {
        Result<DeepPart> part = read_part(path);
        if (!part) return part.error();
        if (!parts.empty())
            if (const std::string why = difference(parts[0].image, part->image); !why.empty())
                return refused(fmt::format("{} and {} {}", parts[0].path, path, why));
        parts.push_back(std::move(*part));
    }
    if (parts.empty()) return refused("nothing to merge");

    image::Window all = parts[0].image.data;
    for (const DeepPart& part : parts) all = image::united(all, part.image.data);
    const auto owners = owners_of(parts, all);
    if (!owners) return owners.error();

    layers::DeepImage merged;
    merged.data = all;
    merged.display = parts[0].image.display;
    merged.pixel_aspect_ratio = parts[0].image.pixel_aspect_ratio;
    merged.attributes = parts[0].image.attributes;
    nlohmann::ordered_json how = how_of(parts[0].image);
    if (how.is_object()) {
        if (const std::string picture = picture_of(output); !picture.empty())
            how["picture"] = picture;
        merged.attributes[how_attribute] = how.dump();
    }
    for (int y = all.y0; y < all.y1; ++y) {
        for (int x = all.x0; x < all.x1; ++x) {
            const DeepPart& part = parts[(*owners)[all.index(x, y)]];
            const size_t pixel = part.image.data.index(x, y);
            const auto first = part.image.samples.begin() + std::ptrdiff_t(part.first[pixel]);
            merged.counts.push_back(part.image.counts[pixel]);
            merged.samples.insert(merged.samples.end(), first,
                                  first + std::ptrdiff_t(part.image.counts[pixel]));
        }
    }
    return layers::write_deep_file(output, merged);
}

}  // namespace io
}  // namespace velatura::compositor
