// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/memory_options.h"
#include "app/scene_loader.h"
#include "base/atomic_file.h"
#include "usd/compose/layer_registry.h"
#include "usd/crate/writer.h"
#include "usd/stage/flatten.h"
#include "usd/text/writer.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

namespace fs = std::filesystem;

struct FlattenArguments {
    std::string scene;
    AssetOptions assets;
    std::string memory_limit;
    bool reads_materialx = false;
    std::string output;
    bool layer_only = false;
    bool crate = false;
};

std::string absolute(const std::string& path) {
    std::error_code failed;
    return fs::absolute(path, failed).lexically_normal().string();
}

/// The layer to write: the composed stage as one layer, or that one file's layer as it stands.
Result<std::shared_ptr<usd::layer::Layer>> make_layer(const FlattenArguments& arguments,
                                                      Diagnostics& diagnostics) {
    if (arguments.layer_only) {
        usd::compose::LayerRegistry registry({}, 1, diagnostics);
        apply_asset_roots(arguments.scene, arguments.assets);
        return registry.open(absolute(arguments.scene));
    }
    const Result<LoadedStage> loaded =
        load_stage(arguments.scene, diagnostics, arguments.assets, arguments.reads_materialx);
    if (!loaded) return loaded.error();
    usd::stage::FlattenOptions options;
    if (!arguments.output.empty())
        options.asset_folder = fs::path(absolute(arguments.output)).parent_path().string();
    return usd::stage::flatten_stage(loaded->stage, options);
}

int run_flatten(const FlattenArguments& arguments) {
    const std::string extension = fs::path(arguments.output).extension().string();
    if (!arguments.output.empty() && extension != ".usda" && extension != ".usdc" &&
        extension != ".usd") {
        fmt::print(stderr,
                   "error: -o {}: expected a name that ends in .usda, .usdc or .usd [usage]\n",
                   arguments.output);
        return UsageError;
    }
    if (arguments.crate && extension == ".usda") {
        fmt::print(
            stderr,
            "error: --usdc writes binary, but -o {} is a text file; use -o FILE.usdc [usage]\n",
            arguments.output);
        return UsageError;
    }
    if (arguments.layer_only && !arguments.assets.overrides.is_empty()) {
        fmt::print(stderr,
                   "error: --layer converts one layer without composition and cannot be combined "
                   "with --session, --variant or --set [usage]\n");
        return UsageError;
    }
    const bool as_crate = arguments.crate || extension == ".usdc";
    if (as_crate && arguments.output.empty()) {
        fmt::print(stderr, "error: --usdc needs a file: -o FILE.usdc [usage]\n");
        return UsageError;
    }
    Diagnostics diagnostics;
    print_diagnostics(diagnostics, false, false);
    const auto layer = make_layer(arguments, diagnostics);
    if (!layer) return fail(layer.error());
    std::string content;
    if (as_crate) {
        Result<std::string> bytes = usd::crate::write_crate_layer(**layer, diagnostics);
        if (!bytes) return fail(bytes.error());
        content = *std::move(bytes);
    } else {
        content = usd::text::write_text_layer(**layer);
    }
    if (arguments.output.empty()) {
        fmt::print("{}", content);
        return Done;
    }
    const Result<void> written = write_file_atomically(arguments.output, content);
    return written ? Done : fail(written.error());
}

}  // namespace

void add_flatten_command(Command& app, std::function<int()>& run) {
    Command command = app.add_subcommand("flatten", "Flatten the composed stage to one USD layer");
    auto arguments = std::make_shared<FlattenArguments>();
    command.add_option("scene", arguments->scene, "USD scene (.usda, .usdc, .usd, .usdz)")
        .required()
        .reads();
    add_materialx_option(command, arguments->reads_materialx);
    command.add_option("-o,--output", arguments->output, "Output layer")
        .type_name("FILE")
        .default_text("print as .usda")
        .writes();
    command.add_flag("--layer", arguments->layer_only,
                     "Convert this one layer, without composition");
    command.add_flag("--usdc", arguments->crate,
                     "Write binary (crate), as for an output FILE.usdc");
    add_scene_groups(command, arguments->assets, arguments->memory_limit);
    command.example("velatura flatten shot.usda -o shot_flat.usdc");
    command.callback([arguments, &run] {
        run = [arguments] {
            return run_in_memory(arguments->memory_limit, [&] { return run_flatten(*arguments); });
        };
    });
}

}  // namespace velatura::app
