// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/file_frame.h"

#include "layers/layer_header.h"

#include <nlohmann/json.hpp>

namespace velatura::compositor {
inline namespace io {

std::optional<double> frame_of(const image::Image& image) {
    const auto scene = nlohmann::json::parse(image.text(layers::scene_attribute), nullptr, false);
    if (!scene.is_object() || !scene.contains("frame") || !scene["frame"].is_number())
        return std::nullopt;
    const double frame = scene["frame"].get<double>();
    // 0 stands for the default time too
    if (frame == 0) return std::nullopt;
    return frame;
}

}  // namespace io
}  // namespace velatura::compositor
