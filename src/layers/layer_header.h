// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "layers/layer_file.h"
#include "layers/resolve.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::layers {

/// Names of the header strings.
inline constexpr const char* closure_attribute = "velatura/closure";
inline constexpr const char* layers_attribute = "velatura/layers";
inline constexpr const char* lights_attribute = "velatura/lights";
inline constexpr const char* casters_attribute = "velatura/casters";
inline constexpr const char* samples_attribute = "velatura/samples";
inline constexpr const char* scene_attribute = "velatura/scene";
inline constexpr const char* stats_attribute = "velatura/stats";
inline constexpr const char* plan_attribute = "velatura/plan";
inline constexpr const char* settings_attribute = "velatura/settings";
inline constexpr const char* sums_attribute = "velatura/sums";
inline constexpr const char* split_attribute = "velatura/split";

/// What a file says about its samples.
struct SampleInfo {
    uint64_t seed = 0;
    uint64_t first = 0, end = 0;  ///< smallest first and largest end of all pixels
    bool is_uniform = true;       ///< every pixel has [first, end)
    uint64_t invalid = 0;
    std::string scene_hash, settings_hash;
    std::vector<BadSample> bad;
};

/// The header strings, parsed.
struct LayerHeader {
    std::vector<accumulate::LayerEntry> layers;
    std::vector<FamilyClosure> closure;  ///< finest first
    std::vector<accumulate::LightGroup> lights;
    std::vector<LightValues> light_values;  ///< of their prims; none in older files
    SampleInfo samples;

    const accumulate::LayerEntry* find(const std::string& name) const;
    const FamilyClosure* find_family(const std::string& name) const;
};

SampleInfo sample_info(const accumulate::SampleSums& sums, const FileInfo& info);

/// Sets all attributes of the contract on the image.
void write_layer_header(image::Image& image,
                        const ResolvedLayers& resolved,
                        const accumulate::LayerSet& set,
                        const SampleInfo& samples,
                        const FileInfo& info);

/// Errors: "not-layers" (no light layers of Velatura), "layers-damaged" (header strings that cannot
/// be understood).
Result<LayerHeader> read_layer_header(const image::Image& image);

/// Layers of the scene, overrides from the command line included, that only one of two scenes has,
/// by their header strings: separated by commas, "nothing" where only the other has more; both
/// empty if the names are the same.
struct DifferentLayers {
    std::string a, b;
};

DifferentLayers different_layers(const std::string& scene_json_a, const std::string& scene_json_b);

/// Those that still hold for a file that is made from another: all but our own, and what describes
/// pixels that are gone (previews, manifests of ids, lists of views).
image::Attributes carried_attributes(const image::Attributes& attributes);

/// The caller's part of the header, for a file that is made from this one.
FileInfo file_info_of(const image::Image& image, const LayerHeader& header);

}  // namespace velatura::layers
