// SPDX-License-Identifier: Apache-2.0
#include "app/scene_loader.h"

#include <chrono>
#include <filesystem>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/hash.h"

namespace velatura::app {

void print_diagnostics(Diagnostics& diagnostics, bool quiet, bool verbose) {
    diagnostics.set_listener([&diagnostics, quiet, verbose](const Diagnostic& d) {
        const bool is_wanted = d.severity == Severity::Error || (d.severity == Severity::Warning ? !quiet : verbose);
        if (is_wanted) fmt::print(stderr, "{}\n", diagnostics.format(d));
    });
}

Result<LoadedStage> load_stage(const std::string& path, Diagnostics& diagnostics) {
    const auto start = std::chrono::steady_clock::now();
    Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    if (!stage) return stage.error();
    LoadedStage loaded{std::move(*stage), 0, {}, 0};
    for (const std::string& file : loaded.stage.layer_files()) {
        loaded.layer_names.push_back(std::filesystem::path(file).filename().string());
        const Result<std::string> bytes = read_file(file);
        loaded.content_hash = hash_combine(loaded.content_hash, hash_string(bytes ? *bytes : file));
    }
    loaded.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return loaded;
}

}  // namespace velatura::app
