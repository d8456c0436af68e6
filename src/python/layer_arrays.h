// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

namespace velatura::python {

/// The pixels of one layer for another language: [height][width][channel], row 0 = top.
struct LayerArray {
    std::vector<std::string> channels;  ///< R, G, B …; as the file names them
    std::variant<std::vector<float>, std::vector<uint32_t>> values;  ///< uint: ids and counts
};

/// A file of light layers, or a rendered frame, with its layers as arrays. Immutable. Thread-safe.
class LayerArrays {
  public:
    explicit LayerArrays(compositor::LayerStack stack);

    const compositor::LayerStack& stack() const { return stack_; }

    /// Of all layers, in the order of the header.
    const std::vector<std::string>& names() const { return names_; }

    /// Converts all layers now.
    void convert_all() const;

    /// The array of a layer, converted on first use and kept; null: there is no such layer.
    const LayerArray* find(const std::string& name) const;

    size_t width() const { return size_t(stack_.image().data.width()); }

    size_t height() const { return size_t(stack_.image().data.height()); }

  private:
    struct Layer {
        std::vector<const image::Channel*> channels;
        std::once_flag is_converted;
        LayerArray array;
    };

    void convert(Layer& layer) const;

    compositor::LayerStack stack_;
    std::vector<std::string> names_;
    std::map<std::string, std::unique_ptr<Layer>> layers_;
};

}  // namespace velatura::python
