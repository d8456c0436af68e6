// SPDX-License-Identifier: Apache-2.0
#include "layers/layer_image.h"

#include "layers/cryptomatte_layers.h"
#include "layers/layer_header.h"
#include "layers/resolve.h"

#include <utility>

namespace velatura::layers {

Result<image::Image> make_layer_image(const accumulate::SampleSums& sums, const FileInfo& info) {
    const SampleInfo samples = sample_info(sums, info);
    if (samples.end <= samples.first) return Error{"no-samples", "there are no samples"};
    ResolvedLayers resolved = resolve_layers(sums);
    if (!resolved.first_failure.empty()) return Error{"closure-failed", resolved.first_failure};
    add_cryptomattes(sums, info.matte_names, resolved);
    write_layer_header(resolved.image, resolved, sums.layer_set(), samples, info);
    return std::move(resolved.image);
}

}  // namespace velatura::layers
