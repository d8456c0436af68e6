// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "layers/top_up.h"
#include "temporary_file.h"

#include <cstdlib>
#include <string>

namespace velatura::fuzz {

namespace {

/// Writes the map that requests can name, request.priority.exr.
void write_map() {
    layers::TopUpRequest request;
    request.samples = 8;
    request.window = {-1, 0, 3, 3};
    request.priority = {0.0f, 1.0f, 2.0f, 0.5f, 1e30f, 1e-30f, 3.0f, 1.0f, 1.0f, 1.0f, 7.0f, 1.0f};
    request.present = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 4000000000u};
    if (!layers::write_top_up(memory_folder() + "/request.json", request)) std::abort();
}

}  // namespace

/// Any bytes are a request for samples beside a map or refused; every pixel of what is read gets as
/// many samples as it has, or more.
void topup(std::string_view bytes) {
    [[maybe_unused]] static const bool has_map = (write_map(), true);
    const Result<layers::TopUpRequest> request =
        layers::read_top_up(memory_file("request.json", bytes));
    if (!request) return;
    const auto counts = layers::place_samples(request->window, request->priority, request->present,
                                              request->samples);
    if (counts.size() != request->present.size()) std::abort();
    for (size_t i = 0; i < counts.size(); ++i)
        if (counts[i] < request->present[i]) std::abort();
}

}  // namespace velatura::fuzz
