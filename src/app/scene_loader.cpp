// SPDX-License-Identifier: Apache-2.0
#include "app/scene_loader.h"

#include "app/failure_line.h"
#include "app/missing_assets.h"
#include "base/asset_bytes.h"
#include "base/hash.h"
#include "base/limits.h"
#include "usd/compose/layer_registry.h"
#include "usd/stage/open_layer.h"
#include "usd/text/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace velatura::app {

namespace {

/// Notes that say what was chosen where the scene leaves it open: printed unless quiet, others when
/// verbose.
constexpr std::string_view choices[] = {"camera-chosen",      "framing-camera", "no-lights",
                                        "no-render-settings", "replay",         "thin-walls"};

bool is_choice(const Diagnostic& d) {
    return std::find(std::begin(choices), std::end(choices), d.code) != std::end(choices);
}

/// Counts what is printed of each code; says in the end how many were not.
class RepeatedCodes {
  public:
    static constexpr size_t printed_limit = 20;

    RepeatedCodes() = default;
    RepeatedCodes(const RepeatedCodes&) = delete;
    RepeatedCodes& operator=(const RepeatedCodes&) = delete;

    ~RepeatedCodes() {
        for (const auto& [code, count] : counts_) {
            if (count <= printed_limit) continue;
            // The collector itself lets no more through
            const bool is_cut = count >= Diagnostics::per_code_limit;
            fmt::print(stderr, "{}{} more like these, not printed [{}]\n",
                       is_cut ? "at least " : "", count - printed_limit, code);
        }
    }

    bool can_print(const std::string& code) { return ++counts_[code] <= printed_limit; }

  private:
    std::map<std::string, size_t> counts_;
};

usd::stage::StageOptions stage_options(const AssetOptions& assets, bool reads_materialx) {
    usd::stage::StageOptions options;
    options.compose.search_paths = assets.search_paths;
    options.compose.max_prims = limits().prims;
    options.compose.max_nodes_per_spec = limits().prims_per_spec;
    options.compose.max_layers = limits().layers;
    options.compose.reads_materialx = reads_materialx;
    const char* const environment = std::getenv("PXR_AR_DEFAULT_SEARCH_PATH");
    for (std::string& folder : usd::compose::split_search_path(environment ? environment : ""))
        options.compose.search_paths.push_back(std::move(folder));
    return options;
}

/// Hash and names of the layers. The one called `made_name` is in memory: its text counts, and
/// `add_names` names it.
template <class AddNames>
void identify(LoadedStage& loaded,
              const std::string& made_name,
              const std::string& made_text,
              const AddNames& add_names) {
    for (const std::string& file : loaded.stage.layer_files()) {
        if (file == made_name) {
            add_names();
            loaded.content_hash = hash_combine(loaded.content_hash, hash_string(made_text));
            continue;
        }
        loaded.layer_names.push_back(std::filesystem::path(file).filename().string());
        const Result<AssetBytesPtr> asset = open_asset_bytes(file);
        loaded.content_hash = hash_combine(
            loaded.content_hash, hash_string(asset ? (*asset)->bytes() : std::string_view(file)));
    }
}

}  // namespace

void print_diagnostics(Diagnostics& diagnostics, bool quiet, bool verbose) {
    const auto repeats = std::make_shared<RepeatedCodes>();
    diagnostics.set_listener([&diagnostics, repeats, quiet, verbose](const Diagnostic& d) {
        note_missing_asset(d);
        if (d.severity == Severity::Error) note_error(fmt::format("{} [{}]", d.message, d.code));
        const bool is_wanted = d.severity == Severity::Error ||
                               (d.severity == Severity::Warning || is_choice(d) ? !quiet : verbose);
        if (is_wanted && (verbose || repeats->can_print(d.code)))
            fmt::print(stderr, "{}\n", diagnostics.format(d));
    });
}

void add_materialx_option(Command& command, bool& reads_materialx) {
    command.add_flag("--materialx", reads_materialx,
                     "Also compose .mtlx files, as render does; without it they are errors, as in "
                     "OpenUSD without its MaterialX plugin");
}

Result<LoadedStage> load_stage(const std::string& path,
                               Diagnostics& diagnostics,
                               const AssetOptions& assets,
                               bool reads_materialx) {
    apply_asset_roots(path, assets);
    return compose_stage(path, diagnostics, assets, reads_materialx);
}

Result<LoadedStage> compose_stage(const std::string& path,
                                  Diagnostics& diagnostics,
                                  const AssetOptions& assets,
                                  bool reads_materialx) {
    const auto start = std::chrono::steady_clock::now();
    Result<OverriddenStage> opened =
        open_stage(assets.overrides, path, stage_options(assets, reads_materialx), diagnostics);
    if (!opened) return opened.error();
    LoadedStage loaded{std::move(opened->stage), 0, {}, 0};
    const std::string made_name = override_layer_name();
    identify(loaded, made_name, opened->made_layer, [&] {
        for (const std::string& text : assets.overrides.variants)
            loaded.layer_names.push_back("--variant " + text);
        for (const std::string& text : assets.overrides.values)
            loaded.layer_names.push_back("--set " + text);
    });
    loaded.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return loaded;
}

Result<LoadedStage> compose_layer(std::shared_ptr<usd::layer::Layer> root,
                                  Diagnostics& diagnostics,
                                  const AssetOptions& assets) {
    const auto start = std::chrono::steady_clock::now();
    if (!assets.overrides.variants.empty() || !assets.overrides.values.empty())
        return Error{"usage", "variant and set need a scene in a file; edit the layer instead"};
    usd::stage::StageOptions options = stage_options(assets, true);
    if (const auto ok = add_session_layers(assets.overrides, options); !ok) return ok.error();
    const std::string name = root->identifier(), text = usd::text::write_text_layer(*root);
    Result<usd::stage::Stage> stage =
        usd::stage::open_layer(std::move(root), std::move(options), diagnostics);
    if (!stage) return stage.error();
    LoadedStage loaded{std::move(*stage), 0, {}, 0};
    identify(loaded, name, text, [&] { loaded.layer_names.push_back(name); });
    loaded.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return loaded;
}

}  // namespace velatura::app
