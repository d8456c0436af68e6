// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "app/failure_line.h"
#include "app/memory_options.h"
#include "app/missing_files.h"
#include "app/progress.h"
#include "app/scene_loader.h"
#include "translate/translate.h"
#include "usd/stage/dump.h"
#include "usd/stage/explain.h"
#include "usd/stage/material_binding.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace velatura::app {

namespace {

struct InfoArguments {
    std::string scene;
    AssetOptions assets;
    std::string memory_limit;
    bool reads_materialx = false;
    bool dump = false;
    bool tree = false;
    std::string material_purpose;  ///< empty: --tree shows no materials
    std::string explain;
    bool has_explain = false;
    double time = 0;
    bool has_time = false;
};

std::string material_text(const usd::stage::Prim& prim, const std::string& purpose) {
    if (purpose.empty() || !prim.is_a("Gprim")) return {};
    const usd::stage::MaterialBinding binding =
        usd::stage::resolve_material(prim, purpose == "allPurpose" ? "" : purpose);
    return binding.material ? " -> " + binding.material.path_string() : " -> no material";
}

void print_tree(const usd::stage::Prim& prim, int depth, const std::string& material_purpose) {
    if (depth >= 0) {
        const std::string type = prim.type_name().str();
        fmt::print("{:{}}{}{}{}{}\n", "", depth * 2, prim.name().str(),
                   type.empty() ? "" : " (" + type + ")", prim.is_instance() ? " [instance]" : "",
                   material_text(prim, material_purpose));
    }
    for (const usd::stage::Prim& child : prim.children())
        print_tree(child, depth + 1, material_purpose);
}

void count_types(const usd::stage::Prim& prim, std::map<std::string, size_t>& counts) {
    for (const usd::stage::Prim& child : prim.children()) {
        const std::string type = child.type_name().str();
        ++counts[type.empty() ? "(untyped)" : type];
        count_types(child, counts);
    }
}

int explain(const usd::stage::Stage& stage,
            const InfoArguments& arguments,
            Diagnostics& diagnostics) {
    const auto time =
        arguments.has_time ? usd::stage::TimeCode(arguments.time) : usd::stage::TimeCode();
    const Result<usd::stage::Explanation> explained =
        usd::stage::explain(stage, arguments.explain, time);
    if (!explained) return fail(explained.error());
    fmt::print("{}", usd::stage::explanation_text(*explained, diagnostics));
    return Done;
}

void print_summary(const LoadedStage& loaded) {
    const usd::stage::Stage& stage = loaded.stage;
    fmt::print("{}\n", stage.root_file());
    fmt::print("  up axis {}, {} m per unit, {} time codes per second", stage.up_axis(),
               stage.meters_per_unit(), stage.time_codes_per_second());
    if (stage.has_time_code_range())
        fmt::print(", frames {} to {}", stage.start_time_code(), stage.end_time_code());
    fmt::print("\n  {}, opened and composed in {:.3f} s\n",
               format_count(loaded.layer_names.size(), "layer"), loaded.seconds);
    std::map<std::string, size_t> counts;
    count_types(stage.pseudo_root(), counts);
    for (const auto& entry : counts) fmt::print("  {:8} {}\n", entry.second, entry.first);
}

int usage(const char* what) {
    fmt::print(stderr, "error: {} [usage]\n", what);
    return UsageError;
}

int run_info(const InfoArguments& arguments) {
    if (int(arguments.dump) + int(arguments.tree) + int(arguments.has_explain) > 1)
        return usage("choose one of --dump, --tree and --explain");
    if (arguments.has_explain && arguments.explain.empty())
        return usage("--explain expects a path, found \"\"");
    if (arguments.has_time && !arguments.has_explain) return usage("--time needs --explain");
    if (!arguments.material_purpose.empty() && !arguments.tree)
        return usage("--material-purpose needs --tree");
    if (std::isnan(arguments.time)) return usage("--time is not a number");
    Diagnostics diagnostics;
    print_diagnostics(diagnostics, false, false);
    const Result<LoadedStage> loaded =
        load_stage(arguments.scene, diagnostics, arguments.assets, arguments.reads_materialx);
    if (!loaded) return fail(loaded.error());
    if (arguments.dump) {
        fmt::print("{}", usd::stage::dump_stage(loaded->stage));
    } else if (arguments.tree) {
        print_tree(loaded->stage.pseudo_root(), -1, arguments.material_purpose);
    } else if (arguments.has_explain) {
        return explain(loaded->stage, arguments, diagnostics);
    } else {
        print_summary(*loaded);
        translate::TranslateOptions options;
        options.time = loaded->stage.start_time_code();
        const NamedFiles files = report_missing_files(loaded->stage, options.time, diagnostics);
        if (files.count > 0)
            fmt::print("  {} of textures, lights and volumes, {} missing\n",
                       format_count(files.count, "file"), files.missing);
        translate::report_choices(loaded->stage, options, diagnostics);
    }
    return Done;
}

}  // namespace

void add_info_command(Command& app, std::function<int()>& run) {
    Command command =
        app.add_subcommand("info",
                           "Summarize a USD scene: prims, missing textures and other files, "
                           "chosen camera and settings");
    auto arguments = std::make_shared<InfoArguments>();
    command.add_option("scene", arguments->scene, "USD scene (.usda, .usdc, .usd, .usdz)")
        .required()
        .reads();
    add_materialx_option(command, arguments->reads_materialx);
    command.add_flag("--dump", arguments->dump,
                     "Print every fact of the composed stage, one per line");
    command.add_flag("--tree", arguments->tree, "Print the prim tree as a renderer sees it");
    command
        .add_option("--material-purpose", arguments->material_purpose,
                    "Material binding purpose of the materials that --tree prints")
        .one_of({"full", "preview", "allPurpose"});
    const Option explain =
        command
            .add_option("--explain", arguments->explain,
                        "Print every opinion on /Prim, /Prim.property or metadata (/Prim#kind), "
                        "strongest first")
            .type_name("PATH");
    const Option time = command.add_option("--time", arguments->time, "Time code of --explain")
                            .default_text("the default time");
    add_scene_groups(command, arguments->assets, arguments->memory_limit);
    command.example("velatura info shot.usda --explain /World/Key.inputs:intensity");
    command.callback([arguments, explain, time, &run] {
        arguments->has_explain = explain.count() > 0;
        arguments->has_time = time.count() > 0;
        run = [arguments] {
            return run_in_memory(arguments->memory_limit, [&] { return run_info(*arguments); });
        };
    });
}

}  // namespace velatura::app
