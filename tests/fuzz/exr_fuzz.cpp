// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "layers/deep_file.h"
#include "layers/layer_file.h"
#include "layers/layer_header.h"
#include "layers/strip_reader.h"
#include "layers/sums_part.h"
#include "temporary_file.h"

#include <cstdlib>
#include <string>

namespace velatura::fuzz {

/// Any bytes are an EXR file or refused; what is read has a value for every pixel of every channel.
void exr(std::string_view bytes) {
    const std::string path = memory_file("fuzz.exr", bytes);
    if (const auto deep = layers::read_deep_file(path)) {
        if (deep->counts.size() != deep->data.pixel_count()) std::abort();
        return;
    }
    if (const auto image = layers::read_layer_file(path)) {
        for (const image::Part& part : image->parts)
            for (const image::Channel& channel : part.channels)
                if (channel.size() != image->data.pixel_count()) std::abort();
        (void)layers::read_layer_header(*image).has_value();
        (void)layers::read_sums(*image).has_value();
    }
    if (const auto strips = layers::StripReader::open(path)) (void)strips->read_all().has_value();
}

}  // namespace velatura::fuzz
