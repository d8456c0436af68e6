// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/merge.h"

#include "compositor/io/layer_stack.h"
#include "layers/layer_header.h"
#include "layers/sums_part.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <tuple>

namespace velatura::compositor {
inline namespace io {

namespace {

struct Input {
    std::string path;
    layers::SampleInfo samples;
    layers::FileInfo info;
    accumulate::SampleSums sums;
};

Error refused(const std::string& why) {
    return {"merge-refused", why};
}

Result<Input> read_input(const std::string& path) {
    const auto stack = LayerStack::load(path);
    if (!stack) return stack.error();
    auto sums = layers::read_sums(stack->image());
    if (!sums && sums.error().code == "no-sums") {
        return refused(fmt::format("{} has no sums to merge; render it with --samples A:B", path));
    }
    if (!sums) return refused(fmt::format("{}: {}", path, sums.error().message));
    return Input{path, stack->header().samples,
                 layers::file_info_of(stack->image(), stack->header()), std::move(*sums)};
}

/// ": --max-depth 4 and 8, halves true and false" of what two objects hold, as JSON pointers
/// without their first slash; empty if they hold the same.
std::string differences(const nlohmann::json& a, const nlohmann::json& b) {
    constexpr size_t max_told = 4;
    if (!a.is_object() || !b.is_object()) return {};
    const nlohmann::json flat_a = a.flatten(), flat_b = b.flatten();
    nlohmann::json all = flat_b;
    all.update(flat_a);
    std::string text;
    size_t count = 0;
    const auto value_of = [](const nlohmann::json& flat, const std::string& key) {
        if (!flat.contains(key)) return std::string("nothing");
        return flat[key].is_string() ? flat[key].get<std::string>() : flat[key].dump();
    };
    for (const auto& [key, value] : all.items()) {
        const std::string in_a = value_of(flat_a, key), in_b = value_of(flat_b, key);
        if (in_a == in_b || ++count > max_told) continue;
        text += fmt::format("{} {} {} and {}", count == 1 ? ":" : ",",
                            key.substr(std::min<size_t>(1, key.size())), in_a, in_b);
    }
    return count > max_told ? fmt::format("{}, and {} more", text, count - max_told) : text;
}

/// What the file says of its settings, beside its first sample.
nlohmann::json settings_of(const Input& input) {
    const auto all = nlohmann::json::parse(input.info.settings_json, nullptr, false);
    if (!all.is_object()) return {};
    nlohmann::json settings = all.value("settings", nlohmann::json::object());
    if (settings.is_object() && all.contains("build")) settings["build"] = all["build"];
    return settings;
}

std::string text_of(const image::Window& w) {
    return fmt::format("{},{} to {},{}", w.x0, w.y0, w.x1, w.y1);
}

/// Why two files are not parts of one render; empty if they are.
std::string mismatch(const Input& a, const Input& b) {
    const auto differ = [&](const std::string& what) {
        return fmt::format("{} and {} {}", a.path, b.path, what);
    };
    if (a.samples.scene_hash != b.samples.scene_hash) {
        const layers::DifferentLayers layers =
            layers::different_layers(a.info.scene_json, b.info.scene_json);
        if (!layers.a.empty())
            return differ(fmt::format("show different scenes: {} in the first, {} in the second",
                                      layers.a, layers.b));
        return differ(fmt::format("show different scenes: the hashes of their layers are {} and {}",
                                  a.samples.scene_hash, b.samples.scene_hash));
    }
    const bool has_same_settings = a.samples.settings_hash == b.samples.settings_hash;
    // The hash leaves the build out
    if (const std::string settings = differences(settings_of(a), settings_of(b)); !settings.empty())
        return differ("were rendered with different settings" + settings);
    if (a.samples.seed != b.samples.seed)
        return differ(
            fmt::format("have different seeds: {} and {}", a.samples.seed, b.samples.seed));
    if (a.sums.window() != b.sums.window())
        return differ(fmt::format("have different data windows: pixels {} and {}",
                                  text_of(a.sums.window()), text_of(b.sums.window())));
    if (a.sums.layer_set() != b.sums.layer_set())
        return differ(
            "store different layers" +
            differences(nlohmann::json::parse(a.sums.layer_set().to_json(), nullptr, false),
                        nlohmann::json::parse(b.sums.layer_set().to_json(), nullptr, false)));
    if (!has_same_settings)
        return differ("were rendered with different settings, which they do not name");
    return {};
}

/// Overlaps and gaps, pixel by pixel.
std::string range_fault(const Input& a, const Input& b) {
    const image::Window& w = a.sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const accumulate::PixelRecord& ra = a.sums.record(x, y);
            const accumulate::PixelRecord& rb = b.sums.record(x, y);
            if (ra.end == rb.first || rb.first == rb.end) continue;
            return fmt::format("{}: pixel {},{} has samples {}:{} in {} and {}:{} in {}",
                               rb.first < ra.end ? "overlap" : "gap", x, y, ra.first, ra.end,
                               a.path, rb.first, rb.end, b.path);
        }
    }
    return {};
}

std::string merged_stats(const std::vector<Input>& inputs) {
    nlohmann::ordered_json j;
    j["mergedFrom"] = nlohmann::ordered_json::array();
    for (const Input& input : inputs) {
        const auto stats = nlohmann::ordered_json::parse(input.info.stats_json, nullptr, false);
        nlohmann::ordered_json one;
        one["samples"] = {input.samples.first, input.samples.end};
        one["stats"] = stats.is_discarded() ? nlohmann::ordered_json() : stats;
        j["mergedFrom"].push_back(std::move(one));
    }
    return j.dump();
}

}  // namespace

Result<layers::WriteReport> merge_files(std::vector<std::string> paths,
                                        const std::string& output,
                                        bool keep_sums) {
    std::vector<Input> inputs;
    for (const std::string& path : paths) {
        auto input = read_input(path);
        if (!input) return input.error();
        inputs.push_back(std::move(*input));
    }
    if (inputs.empty()) return refused("nothing to merge");
    std::stable_sort(inputs.begin(), inputs.end(), [](const Input& a, const Input& b) {
        return std::tie(a.samples.first, a.samples.end) < std::tie(b.samples.first, b.samples.end);
    });
    // Reject before adding anything, so that the reason names the files
    for (size_t i = 1; i < inputs.size(); ++i) {
        if (std::string why = mismatch(inputs[0], inputs[i]); !why.empty()) return refused(why);
        if (std::string why = range_fault(inputs[i - 1], inputs[i]); !why.empty())
            return refused(why);
    }
    layers::FileInfo info = inputs[0].info;
    info.stats_json = merged_stats(inputs);
    info.store_sums = keep_sums;
    for (size_t i = 1; i < inputs.size(); ++i) {
        inputs[0].sums.append(inputs[i].sums);
        info.bad_samples.insert(info.bad_samples.end(), inputs[i].info.bad_samples.begin(),
                                inputs[i].info.bad_samples.end());
        for (size_t k = 0; k < info.matte_names.size(); ++k) {
            const std::vector<std::string>& names = inputs[i].info.matte_names[k];
            info.matte_names[k].insert(info.matte_names[k].end(), names.begin(), names.end());
        }
    }
    std::sort(info.bad_samples.begin(), info.bad_samples.end(), [](const auto& a, const auto& b) {
        return std::tie(a.sample, a.y, a.x) < std::tie(b.sample, b.y, b.x);
    });
    if (info.bad_samples.size() > 16) info.bad_samples.resize(16);
    return layers::write_layer_file(output, inputs[0].sums, info);
}

}  // namespace io
}  // namespace velatura::compositor
