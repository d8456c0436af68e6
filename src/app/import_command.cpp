// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/memory_options.h"
#include "app/scene_loader.h"
#include "import/import.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

namespace velatura::app {

namespace {

struct ImportArguments {
    std::string file, output;
    AssetOptions assets;
    std::string memory_limit;
    bool quiet = false, verbose = false;
};

int run_import(const ImportArguments& arguments) {
    const std::filesystem::path output(arguments.output);
    if (output.extension() != ".usda" && output.extension() != ".usd") {
        fmt::print(stderr, "error: output {} must end in .usda or .usd [usage]\n",
                   arguments.output);
        return UsageError;
    }
    apply_asset_roots(arguments.file, arguments.assets);
    Diagnostics diagnostics;
    print_diagnostics(diagnostics, arguments.quiet, arguments.verbose);
    const Result<velatura::import::ImportSummary> summary =
        velatura::import::import_file(arguments.file, arguments.output, diagnostics);
    if (!summary) return fail(summary.error());
    if (!arguments.quiet)
        fmt::print(
            "{}: {} meshes ({} instances), {} materials, {} lights, {} cameras, {} embedded "
            "textures\n",
            arguments.output, summary->meshes, summary->instances, summary->materials,
            summary->lights, summary->cameras, summary->textures);
    return Done;
}

}  // namespace

void add_import_command(Command& app, std::function<int()>& run) {
    Command command = app.add_subcommand(
        "import", "Convert a .dae, .obj, .gltf, .glb, .ply or .fbx file to .usda");
    auto arguments = std::make_shared<ImportArguments>();
    command.add_option("file", arguments->file, "Scene or model").required().reads();
    command.add_option("-o,--output", arguments->output, "Output layer, .usda")
        .required()
        .type_name("OUT.usda")
        .writes();
    command.add_flag("-q,--quiet", arguments->quiet, "Print errors only");
    command.add_flag("-v,--verbose", arguments->verbose, "Print notes too");
    Command limits = command.add_group("Files and limits");
    add_memory_option(limits, arguments->memory_limit);
    add_root_options(limits, arguments->assets);
    command.example("velatura import chair.gltf -o chair.usda");
    command.callback([arguments, &run] {
        run = [arguments] {
            return run_in_memory(arguments->memory_limit, [&] { return run_import(*arguments); });
        };
    });
}

}  // namespace velatura::app
