// SPDX-License-Identifier: Apache-2.0
#include "python/layer_arrays.h"

#include "base/tasks.h"
#include "image/digest.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

namespace velatura::python {

namespace {

std::string_view last_word(std::string_view channel) {
    return channel.substr(channel.rfind('.') + 1);
}

/// Colors and vectors in their usual order, others as they are.
size_t rank(std::string_view channel) {
    constexpr std::string_view usual[] = {"R", "G", "B", "A", "X", "Y", "Z"};
    const std::string_view word = last_word(channel);
    return size_t(std::find(std::begin(usual), std::end(usual), word) - std::begin(usual));
}

/// "b1" of "b1.R", "rgba" of the beauty's channels, "Z" of "Z".
std::string layer_of(const std::string& channel) {
    const size_t dot = channel.rfind('.');
    if (dot != std::string::npos) return channel.substr(0, dot);
    return rank(channel) < 4 ? "rgba" : channel;
}

template <class T>
std::vector<T> interleaved(const std::vector<const image::Channel*>& channels) {
    const size_t pixels = channels[0]->size(), stride = channels.size();
    std::vector<T> values(pixels * stride);
    constexpr size_t at_once = size_t(1) << 16;
    parallel_for((pixels + at_once - 1) / at_once, [&](size_t piece) {
        const size_t begin = piece * at_once, end = std::min(begin + at_once, pixels);
        for (size_t c = 0; c < stride; ++c)
            std::visit(
                [&](const auto& source) {
                    for (size_t i = begin; i < end; ++i) values[i * stride + c] = T(source[i]);
                },
                channels[c]->data);
    });
    return values;
}

}  // namespace

LayerArrays::LayerArrays(compositor::LayerStack stack) : stack_(std::move(stack)) {
    for (const image::Part& part : stack_.image().parts)
        for (const image::Channel& c : part.channels) {
            if (image::is_bookkeeping(c.name)) continue;
            std::unique_ptr<Layer>& layer = layers_[layer_of(c.name)];
            if (!layer) layer = std::make_unique<Layer>();
            layer->channels.push_back(&c);
        }
    // A file has its channels sorted: the header's order is that of the render as well
    for (const accumulate::LayerEntry& entry : stack_.header().layers)
        if (layers_.contains(entry.name)) names_.push_back(entry.name);
    const std::set<std::string> listed(names_.begin(), names_.end());
    for (const auto& [name, layer] : layers_)
        if (!listed.contains(name)) names_.push_back(name);
    for (const auto& [name, layer] : layers_)
        std::stable_sort(layer->channels.begin(), layer->channels.end(),
                         [](const image::Channel* a, const image::Channel* b) {
                             return rank(a->name) < rank(b->name);
                         });
}

void LayerArrays::convert(Layer& layer) const {
    std::call_once(layer.is_converted, [&] {
        const bool is_uint = std::all_of(
            layer.channels.begin(), layer.channels.end(),
            [](const image::Channel* c) { return c->type() == image::ChannelType::Uint; });
        for (const image::Channel* c : layer.channels)
            layer.array.channels.emplace_back(last_word(c->name));
        if (is_uint)
            layer.array.values = interleaved<uint32_t>(layer.channels);
        else
            layer.array.values = interleaved<float>(layer.channels);
    });
}

void LayerArrays::convert_all() const {
    for (const auto& [name, layer] : layers_) convert(*layer);
}

const LayerArray* LayerArrays::find(const std::string& name) const {
    const auto found = layers_.find(name);
    if (found == layers_.end()) return nullptr;
    convert(*found->second);
    return &found->second->array;
}

}  // namespace velatura::python
