// SPDX-License-Identifier: Apache-2.0
#include "compositor/layer_stack.h"

#include "compositor/plain_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace velatura::compositor {

Error layer_missing(const std::string& layer) {
    return {"layer-missing",
            fmt::format("the header names layer {}, but the file does not have all of its "
                        "channels; was a part taken out of it?",
                        layer)};
}

Result<LayerStack> LayerStack::from_image(image::Image image, ForeignFiles foreign) {
    LayerStack stack;
    auto header = image::read_layer_header(image);
    if (header) {
        stack.header_ = std::move(*header);
        for (size_t p = 0; p < image.parts.size(); ++p) {
            const auto& channels = image.parts[p].channels;
            for (size_t c = 0; c < channels.size(); ++c)
                stack.channels_.try_emplace(channels[c].name, image::ChannelPlace{p, c});
        }
    } else {
        if (foreign == ForeignFiles::Refuse || header.error().code != "not-layers")
            return header.error();
        auto plain = plain_layers(image);
        if (!plain) return plain.error();
        stack.header_ = std::move(plain->header);
        stack.channels_ = std::move(plain->channels);
        stack.is_plain_ = true;
    }
    stack.image_ = std::move(image);
    return stack;
}

Result<LayerStack> LayerStack::describe(const image::StripReader& file,
                                        const std::string& path,
                                        ForeignFiles foreign) {
    auto stack = from_image(file.description(), foreign);
    if (!stack) return Error{stack.error().code, path + ": " + stack.error().message};
    stack->path_ = path;
    return stack;
}

Result<LayerStack> LayerStack::load(const std::string& path, ForeignFiles foreign) {
    const auto file = image::StripReader::open(path);
    if (!file) return file.error();
    auto image = file->read_all();
    if (!image) return image.error();
    auto stack = from_image(std::move(*image), foreign);
    if (!stack) return Error{stack.error().code, path + ": " + stack.error().message};
    stack->path_ = path;
    return stack;
}

std::optional<image::ChannelPlace> LayerStack::place(const std::string& layer, size_t c) const {
    constexpr std::array names = {"R", "G", "B", "A"};
    const std::string name = layer == "rgba" ? std::string(names[c]) : layer + "." + names[c];
    const auto at = channels_.find(name);
    if (at == channels_.end()) return std::nullopt;
    return at->second;
}

const image::Channel* LayerStack::channel(const std::string& layer, size_t c) const {
    const auto at = place(layer, c);
    return at ? &image_.parts[at->part].channels[at->channel] : nullptr;
}

Result<void> LayerStack::check_stored(const std::string& layer) const {
    for (size_t c = 0; c < 3; ++c) {
        if (!place(layer, c)) return layer_missing(layer);
    }
    return {};
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
