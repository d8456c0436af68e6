// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/outputs.h"

#include "base/atomic_file.h"
#include "base/check.h"
#include "compositor/bake/bake.h"
#include "compositor/bake/bake_layer.h"
#include "compositor/exports/export.h"
#include "compositor/mix/mix.h"
#include "compositor/noise/top_up.h"
#include "layers/layer_file.h"
#include "layers/sums_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

namespace velatura::compositor::window {

namespace {

namespace fs = std::filesystem;

Result<std::string> write_image(const OutputSource& source, const std::string& path) {
    const ImageTask& task = *source.task;
    const image::Image mixed =
        mix::apply_mix(source.levels->stack(0), *task.plans[0], task.look, false);
    if (path.ends_with(".exr")) {
        const auto written = layers::write_image_file(path, mixed);
        if (!written) return written.error();
        return std::string();
    }
    const auto written = mix::write_display(path, mixed, task.look);
    if (!written) return written.error();
    return std::string();
}

using Script = std::string (*)(const exports::MixRecipe&);

/// Scripts read one file.
Result<void> check_one_file(const OutputSource& source) {
    if (!source.levels->stack(0).path().empty()) return {};
    return Error{"export-several",
                 "several files are open: mix them to one with velatura-comp mix --with-layers and "
                 "export from that"};
}

template <Script script>
Result<std::string> write_script(const OutputSource& source, const std::string& path) {
    if (const auto one = check_one_file(source); !one) return one.error();
    std::error_code failed;
    // The script may be run from anywhere
    const fs::path whole = fs::absolute(source.layers, failed);
    const auto recipe =
        exports::mix_recipe(source.levels->stack(0), *source.task->plans[0], source.task->look,
                            failed ? source.layers : whole.lexically_normal().string());
    if (!recipe) return recipe.error();
    if (auto written = write_file_atomically(path, script(*recipe)); !written)
        return written.error();
    return std::string();
}

Result<std::string> write_nuke(const OutputSource& source, const std::string& path) {
    if (const auto one = check_one_file(source); !one) return one.error();
    // By where the script lies, so that both can be moved together
    std::error_code failed;
    const fs::path folder = fs::absolute(path).lexically_normal().parent_path();
    const fs::path layers = fs::proximate(fs::absolute(source.layers), folder, failed);
    const auto script =
        exports::nuke_script(source.levels->stack(0), *source.task->plans[0], source.task->look,
                             failed ? source.layers : layers.string());
    if (!script) return script.error();
    if (auto written = write_file_atomically(path, *script); !written) return written.error();
    return std::string();
}

Result<std::string> write_bake(const OutputSource& source, const std::string& path) {
    if (!path.ends_with(".usda")) return Error{"bad-output", path + " is not .usda"};
    const auto bake = bake::bake_look(source.levels->stack(0), source.task->look);
    if (!bake) return bake.error();
    const auto text = bake::bake_layer_text(*bake, fs::path(source.layers).filename().string());
    if (!text) return text.error();
    if (auto written = write_file_atomically(path, *text); !written) return written.error();
    std::string said = fmt::format("{} lights", bake->lights.size());
    for (const std::string& line : bake->left) said += "; not baked: " + line;
    for (const std::string& line : bake->notes) said += "; note: " + line;
    return said;
}

Result<std::string> write_request(const OutputSource& source, const std::string& path) {
    if (!path.ends_with(".json")) return Error{"bad-output", path + " is not .json"};
    if (const auto one = check_one_file(source); !one) return one.error();
    const auto counts = layers::read_sample_counts(source.layers);
    if (!counts && counts.error().code.starts_with("io-")) return counts.error();
    if (!counts)
        return Error{counts.error().code, fmt::format("{}: {}; render with --resumable",
                                                      source.layers, counts.error().message)};
    // As `plan` without a target: the error of the render as it is
    const auto plan = noise::plan_top_up(source.levels->stack(0), *counts, source.task->look, {});
    if (!plan) return plan.error();
    if (const auto written = layers::write_top_up(path, plan->request); !written)
        return written.error();
    return fmt::format("{:.4g} samples per pixel for an error of {:.3g} % (now {:.4g})",
                       plan->request.samples, 100 * plan->error_after, plan->samples_now);
}

constexpr std::array table = {
    Output{OutputKind::Image, Action::SaveImage, "Save image", ".png", "image.png, .jpg or .exr",
           write_image},
    Output{OutputKind::NukeScript, Action::ExportNuke, "Export a Nuke script", ".nk", "mix.nk",
           write_nuke},
    Output{OutputKind::OiioScript, Action::ExportOiio, "Export a shell script for oiiotool", ".sh",
           "mix.sh", write_script<exports::oiio_script>},
    Output{OutputKind::BlenderScript, Action::ExportBlender, "Export a Python script for Blender",
           ".py", "mix.py", write_script<exports::blender_script>},
    Output{OutputKind::Bake, Action::BakeLook, "Bake the mix as a USD layer of lights", ".usda",
           "lights.usda", write_bake},
    Output{OutputKind::Request, Action::RequestSamples,
           "Request samples where this mix is noisy (render --for-mix)", ".json", "request.json",
           write_request}};

}  // namespace

std::span<const Output> outputs() {
    return table;
}

const Output& output_of(OutputKind kind) {
    const auto at =
        std::find_if(table.begin(), table.end(), [&](const Output& o) { return o.kind == kind; });
    VELATURA_CHECK(at != table.end(), "an output that is not in the table");
    return *at;
}

std::optional<OutputKind> output_of(Action action) {
    for (const Output& output : table) {
        if (output.action == action) return output.kind;
    }
    return std::nullopt;
}

std::vector<std::string> files_of(OutputKind kind, const std::string& path) {
    std::vector<std::string> files = {path};
    if (kind == OutputKind::Request)
        files.push_back(fs::path(path).replace_extension(".priority.exr").string());
    return files;
}

}  // namespace velatura::compositor::window
