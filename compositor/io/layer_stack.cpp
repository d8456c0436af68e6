// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/layer_stack.h"

#include "compositor/io/foreign_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace velatura::compositor {
inline namespace io {

Error layer_missing(const std::string& layer) {
    return {"layer-missing",
            fmt::format("the header names layer {}, but the file does not have all of its "
                        "channels; was a part taken out of it?",
                        layer)};
}

Result<LayerStack> LayerStack::from_plain(image::Image image,
                                          const std::string& view,
                                          const ForeignInputs* files) {
    auto plain = foreign_layers(image, view, files);
    if (!plain) return plain.error();
    LayerStack stack;
    stack.header_ = std::move(plain->header);
    stack.channels_ = std::move(plain->channels);
    stack.data_ = std::move(plain->data);
    stack.views_ = std::move(plain->views);
    stack.view_ = std::move(plain->view);
    stack.notes_ = std::move(plain->notes);
    stack.is_plain_ = true;
    stack.image_ = std::move(image);
    return stack;
}

Result<LayerStack> LayerStack::from_image(image::Image image,
                                          ForeignFiles foreign,
                                          const std::string& view) {
    auto header = layers::read_layer_header(image);
    if (!header) {
        if (foreign == ForeignFiles::Reject || header.error().code != "not-layers")
            return header.error();
        return from_plain(std::move(image), view, nullptr);
    }
    if (!view.empty())
        return Error{"unknown-view",
                     fmt::format("no view '{}': a render of Velatura has only one", view)};
    LayerStack stack;
    stack.header_ = std::move(*header);
    for (size_t p = 0; p < image.parts.size(); ++p) {
        const auto& channels = image.parts[p].channels;
        for (size_t c = 0; c < channels.size(); ++c)
            stack.channels_.try_emplace(channels[c].name, layers::ChannelRef{p, c});
    }
    stack.image_ = std::move(image);
    return stack;
}

void LayerStack::note_skipped(const layers::StripReader& file) {
    for (const std::string& part : file.foreign_parts())
        notes_.push_back(
            fmt::format("part {} skipped: its data window is too far from the others", part));
    for (const std::string& part : file.deep_parts())
        notes_.push_back(fmt::format("part {} skipped: deep data are not read", part));
}

Result<LayerStack> LayerStack::describe(const layers::StripReader& file,
                                        const std::string& path,
                                        ForeignFiles foreign,
                                        const std::string& view) {
    auto stack = from_image(file.description(), foreign, view);
    if (!stack) return Error{stack.error().code, path + ": " + stack.error().message};
    stack->note_skipped(file);
    stack->path_ = path;
    return stack;
}

Result<LayerStack> LayerStack::describe_together(const layers::StripReader& files,
                                                 const std::vector<std::string>& names,
                                                 const std::string& view) {
    ForeignInputs plain{names, {}};
    for (size_t p = 0; p < files.description().parts.size(); ++p)
        plain.of_part.push_back(files.file_of(p));
    auto stack = from_plain(files.description(), view, &plain);
    if (!stack) return stack;
    stack->note_skipped(files);
    return stack;
}

Result<LayerStack> LayerStack::load(const std::string& path,
                                    ForeignFiles foreign,
                                    const std::string& view) {
    const auto file = layers::StripReader::open(path);
    if (!file) return file.error();
    auto image = file->read_all();
    if (!image) return image.error();
    auto stack = from_image(std::move(*image), foreign, view);
    if (!stack) return Error{stack.error().code, path + ": " + stack.error().message};
    stack->note_skipped(*file);
    stack->path_ = path;
    return stack;
}

LayerStack LayerStack::with_pixels(image::Image image) && {
    image_ = std::move(image);
    return std::move(*this);
}

size_t LayerStack::beauty_part() const {
    if (const auto beauty = place("rgba", 0)) return beauty->part;
    for (const accumulate::LayerEntry& entry : header_.layers) {
        if (const auto row = place(entry.name, 0)) return row->part;
    }
    return 0;
}

std::vector<layers::ChannelRef> LayerStack::data_channels(const std::string& layer) const {
    if (const auto at = data_.find(layer); at != data_.end()) return at->second;
    std::vector<layers::ChannelRef> places;
    for (size_t p = 0; p < image_.parts.size(); ++p) {
        const auto& channels = image_.parts[p].channels;
        for (size_t c = 0; c < channels.size(); ++c) {
            if (channels[c].name == layer || channels[c].name.starts_with(layer + "."))
                places.push_back({p, c});
        }
    }
    return places;
}

std::optional<layers::ChannelRef> LayerStack::place(const std::string& layer, size_t c) const {
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
    for (const accumulate::LightGroup& g : header_.lights) names.push_back(g.name);
    return names;
}

std::vector<std::string> LayerStack::column_names() const {
    std::vector<std::string> names;
    for (const accumulate::LayerEntry& e : header_.layers) {
        const bool has_bounces =
            e.family == "bounces" || e.family == "matrix" || e.family == "lobe-matrix";
        if (!has_bounces || std::find(names.begin(), names.end(), e.bounce) != names.end())
            continue;
        names.push_back(e.bounce);
    }
    return names;
}

std::vector<std::string> LayerStack::lobe_names() const {
    std::vector<std::string> names;
    for (const accumulate::LayerEntry& e : header_.layers) {
        if (e.family == "lobe-matrix" &&
            std::find(names.begin(), names.end(), e.lobe) == names.end())
            names.push_back(e.lobe);
    }
    return names;
}

}  // namespace io
}  // namespace velatura::compositor
