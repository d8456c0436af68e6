// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/image_storage.h"

#include "compositor/io/image_name.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace velatura::compositor {
inline namespace io {

namespace {

std::vector<std::string> compression_names() {
    std::vector<std::string> names;
    for (const auto& [name, compression] : image::compression_table) names.emplace_back(name);
    return names;
}

std::vector<std::string> depths_of(const image::DisplayFormat& format) {
    std::vector<std::string> depths;
    for (const int bits : format.bits)
        if (bits > 0) depths.push_back(std::to_string(bits));
    return depths;
}

Error not_stored(const std::string& option, const std::string& output, const std::string& instead) {
    return {"bad-output", fmt::format("{} is not for {}: {}", option,
                                      std::filesystem::path(output).extension().string(), instead)};
}

}  // namespace

void ImageStorageOptions::add_to(Command& command) {
    command
        .add_option(
            "--depth", depth,
            "Channel depth: half or float (.exr), 8 or 16 bits (.png, .tif), 8, 10, 12 or 16 "
            "bits (.dpx)")
        .default_text("float for .exr, 10 for .dpx, else 8")
        .one_of({"half", "float", "8", "10", "12", "16"});
    command.add_option("--compression", compression, "EXR compression, lossless")
        .default_text("zip")
        .one_of(compression_names());
    command.add_flag("--alpha", has_alpha,
                     "Store alpha in .png or .tif, with unpremultiplied colors");
    command.add_flag(
        "--dither", has_dither,
        "Dither .png, .jpg, .tif and .dpx by one step before rounding, against banding");
}

Result<ImageStorage> ImageStorageOptions::storage(const std::string& output) const {
    ImageStorage out;
    out.has_alpha = has_alpha;
    out.display.has_dither = has_dither;
    if (is_exr(output)) {
        if (has_dither)
            return not_stored("--dither", output, "its values are not rounded to steps");
        if (has_alpha) return not_stored("--alpha", output, "it has the alpha of the mix anyway");
        if (!depth.empty() && depth != "half" && depth != "float")
            return not_stored("--depth " + depth, output, "it has half, float");
        if (depth == "half") out.type = image::ChannelType::Half;
        for (const auto& [name, known] : image::compression_table)
            if (compression == name) out.compression = known;
        return out;
    }
    const image::DisplayFormat* const format = image::display_format(output);
    if (!format) return Error{"bad-output", output + " is not " + image_names()};
    if (!compression.empty())
        return not_stored("--compression", output, "it has only one compression");
    if (has_alpha && !format->has_alpha)
        return not_stored("--alpha", output, ".png, .tif and .exr store it");
    const std::vector<std::string> depths = depths_of(*format);
    if (!depth.empty() && std::find(depths.begin(), depths.end(), depth) == depths.end())
        return not_stored("--depth " + depth, output,
                          fmt::format("it has {} bits", fmt::join(depths, ", ")));
    if (!depth.empty()) out.display.bits = std::stoi(depth);
    return out;
}

}  // namespace io
}  // namespace velatura::compositor
