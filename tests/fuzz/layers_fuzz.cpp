// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "image_input.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"

#include <nlohmann/json.hpp>

#include <cstdlib>

namespace velatura::fuzz {

namespace {

/// States the digest that the channels have: nobody makes one by chance, and who damages a file on
/// purpose makes it.
void state_digest(image::Image& image) {
    auto stated = nlohmann::json::parse(image.text(layers::sums_attribute), nullptr, false);
    if (!stated.is_object()) return;
    const auto right = nlohmann::json::parse(layers::sums_json({}, image));
    for (const char* digest : {"records", "sha256"}) stated[digest] = right[digest];
    image.attributes[layers::sums_attribute] =
        stated.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

/// Any header strings and channels (image_input.h) are light layers with their sums or refused;
/// sums that are read are stored and come back with as many samples in every pixel.
void layers(std::string_view bytes) {
    image::Image image = image_of(bytes);
    (void)layers::read_layer_header(image).has_value();
    state_digest(image);
    const auto sums = layers::read_sums(image);
    if (!sums) return;
    const auto records = layers::stored_records(image);
    const auto parts = layers::sums_parts(*sums);
    if (!records || !parts) std::abort();
    for (int y = image.data.y0; y < image.data.y1; ++y) {
        for (int x = image.data.x0; x < image.data.x1; ++x) {
            const accumulate::PixelRecord& record = sums->record(x, y);
            const accumulate::PixelRecord& stored = (*records)[image.data.index(x, y)];
            if (record.end - record.first != stored.end - stored.first) std::abort();
        }
    }
}

}  // namespace velatura::fuzz
