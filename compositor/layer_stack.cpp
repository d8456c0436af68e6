// SPDX-License-Identifier: Apache-2.0
#include "compositor/layer_stack.h"

#include "image/layer_file.h"

#include <algorithm>

namespace velatura::compositor {

Result<LayerStack> LayerStack::from_image(image::Image image) {
    auto header = image::read_layer_header(image);
    if (!header) return header.error();
    LayerStack stack;
    stack.image_ = std::move(image);
    stack.header_ = std::move(*header);
    for (size_t p = 0; p < stack.image_.parts.size(); ++p) {
        const auto& channels = stack.image_.parts[p].channels;
        for (size_t c = 0; c < channels.size(); ++c)
            stack.channels_.try_emplace(channels[c].name, p, c);
    }
    return stack;
}

Result<LayerStack> LayerStack::load(const std::string& path) {
    auto image = image::read_layer_file(path);
    if (!image) return image.error();
    auto stack = from_image(std::move(*image));
    if (!stack) return Error{stack.error().code, path + ": " + stack.error().message};
    return stack;
}

const image::Channel* LayerStack::channel(const std::string& layer, size_t c) const {
    constexpr const char* names[] = {"R", "G", "B"};
    const std::string name = layer == "rgba" ? std::string(names[c]) : layer + "." + names[c];
    const auto at = channels_.find(name);
    if (at == channels_.end()) return nullptr;
    return &image_.parts[at->second.first].channels[at->second.second];
}

std::vector<std::string> LayerStack::group_names() const {
    std::vector<std::string> names;
    for (const image::LightGroup& g : header_.lights) names.push_back(g.name);
    return names;
}

std::vector<std::string> LayerStack::column_names() const {
    std::vector<std::string> names;
    for (const image::LayerEntry& e : header_.layers) {
        const bool has_bounces = e.family == "bounces" || e.family == "matrix";
        if (!has_bounces || std::find(names.begin(), names.end(), e.bounce) != names.end())
            continue;
        names.push_back(e.bounce);
    }
    return names;
}

}  // namespace velatura::compositor
