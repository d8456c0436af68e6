// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/bake/bake.h"
#include "compositor/bake/bake_check.h"
#include "compositor/bake/bake_layer.h"
#include "compositor/bake/matching_render.h"
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/look_command_options.h"
#include "compositor/io/layer_stack.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

namespace fs = std::filesystem;

struct BakeOptions {
    std::string input, output, scene, program, more_arguments;
    LookOptions look;
    bool prove = false;
    std::vector<double> crop;
    uint64_t spp = 0;
};

/// A folder that goes when its owner does.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string name = (fs::temp_directory_path() / "velatura-bake-XXXXXX").string();
        if (mkdtemp(name.data())) path_ = name;
    }

    ~TemporaryFolder() {
        std::error_code ignored;
        if (!path_.empty()) fs::remove_all(path_, ignored);
    }

    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    bool is_made() const { return !path_.empty(); }

    std::string file(const char* name) const { return (path_ / name).string(); }

  private:
    fs::path path_;
};

/// Runs a program to its end. Errors: "prove-failed" (cannot be started, or fails).
Result<void> run_program(std::vector<std::string> arguments) {
    std::vector<char*> pointers;
    for (std::string& a : arguments) pointers.push_back(a.data());
    pointers.push_back(nullptr);
    pid_t pid = 0;
    if (posix_spawnp(&pid, pointers[0], nullptr, nullptr, pointers.data(), environ) != 0)
        return Error{
            "prove-failed",
            fmt::format("cannot start {}; name the renderer with --velatura PATH", arguments[0])};
    int status = 0;
    while (waitpid(pid, &status, 0) < 0) {
        if (errno != EINTR) return Error{"prove-failed", "lost the renderer"};
    }
    // 3: stopped before a target that the scene asks for; the image is there
    if (WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3)) return {};
    return Error{"prove-failed", fmt::format("{} {} failed", arguments[0], arguments[1])};
}

/// The renderer beside this program.
std::string default_program() {
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    return error ? "velatura" : (self.parent_path() / "velatura").string();
}

/// The scene with the baked layer above it, rendered like the file of the mix.
Result<LayerStack> render_baked(const BakeOptions& o, const LayerStack& mixed) {
    const TemporaryFolder folder;
    if (!folder.is_made()) return Error{"io-write", "cannot make a temporary folder"};
    const std::string program = o.program.empty() ? default_program() : o.program;
    const std::string own = folder.file("own.usda"), stacked = folder.file("baked.usda"),
                      image = folder.file("baked.exr");
    // Stage metadata count in the root layer alone
    if (auto done = run_program({program, "flatten", "--layer", o.scene, "-o", own}); !done)
        return done.error();
    const auto text = read_file(own);
    if (!text) return text.error();
    const auto metadata = bake::stage_metadata(*text);
    if (!metadata) return metadata.error();
    if (auto done = write_file_atomically(
            stacked, bake::stacked_layer_text(fs::absolute(o.output).string(),
                                              fs::absolute(o.scene).string(), *metadata));
        !done)
        return done.error();
    std::optional<std::array<double, 4>> crop;
    if (o.crop.size() == 4) crop = {o.crop[0], o.crop[1], o.crop[2], o.crop[3]};
    std::vector<bake::RenderOption> options = {{"--progress", {"none"}},
                                               {"--halves", {}},
                                               {"--float-layers", {}},
                                               {"--layers", {"matrix"}}};
    bake::override_options(options, bake::matching_render_options(mixed, crop));
    if (o.spp > 0) bake::override_options(options, {{"--spp", {std::to_string(o.spp)}}});
    bake::override_options(options, bake::options_of(o.more_arguments));
    std::vector<std::string> arguments = {program, "render", stacked, "-o", image, "-q"};
    for (std::string& argument : bake::arguments_of(options))
        arguments.push_back(std::move(argument));
    if (auto done = run_program(std::move(arguments)); !done) return done.error();
    return LayerStack::load(image);
}

int prove(const BakeOptions& o, const LayerStack& mixed, const bake::Bake& bake) {
    const auto rendered = render_baked(o, mixed);
    if (!rendered) return report(rendered.error());
    const auto rows = bake::check_bake(mixed, bake, *rendered);
    if (!rows) return report(rows.error());
    bool agrees = true;
    fmt::print("{:<24} {:>12} {:>12}  in standard errors: mean, 8x8 blocks\n", "light", "mixed",
               "rendered");
    for (const bake::BakeCheckRow& row : *rows) {
        fmt::print("{:<24} {:>12.6g} {:>12.6g}  {:5.2f} {:5.2f}  {}\n", row.group, row.composite,
                   row.render, row.mean_sigmas, row.block_sigmas,
                   !row.is_compared ? "baked in part, not compared"
                   : row.agrees()   ? "agrees"
                                    : "DIFFERS");
        agrees = agrees && row.agrees();
    }
    return agrees ? done
                  : report({"proof-failed",
                            "the render with the baked layer differs from the mix by more than its "
                            "noise"});
}

int run_bake(const BakeOptions& o) {
    if (!o.output.ends_with(".usda")) return report({"bad-output", o.output + " is not .usda"});
    if (o.prove && o.scene.empty()) return report({"bad-output", "--prove needs --scene SCENE"});
    const auto mix = o.look.open(o.input);
    if (!mix) return report(mix.error());
    const auto bake = bake::bake_look(mix->stack, mix->look);
    if (!bake) return report(bake.error());
    const auto text = bake::bake_layer_text(*bake, fs::path(mix->input).filename().string());
    if (!text) return report(text.error());
    if (auto written = write_file_atomically(o.output, *text); !written)
        return report(written.error());
    for (const std::string& line : bake->left) fmt::print(stderr, "warning: not baked: {}\n", line);
    for (const std::string& line : bake->notes) fmt::print(stderr, "note: {}\n", line);
    fmt::print("{}: {} lights\n", o.output, bake->lights.size());
    if (o.prove) {
        if (const int code = prove(o, mix->stack, *bake); code != done) return code;
    }
    return bake->left.empty() ? done : partly;
}

}  // namespace

void add_bake_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<BakeOptions>();
    Command command = app.add_subcommand(
        "bake", "Write a mix as a USD layer of light intensities, exposures and colors");
    command.add_option("input", o->input, "File of light layers, or shot.####.exr with --frame")
        .required()
        .reads();
    command.add_option("-o,--output", o->output, "USD layer, .usda, for --session or sublayers")
        .required()
        .writes();
    o->look.add_to(command);
    Option prove = command.add_flag(
        "--prove", o->prove,
        "Proof: render the scene with the layer and compare it with the mix, within "
        "the noise of both; needs --scene and a file rendered with --halves");
    // Of the proof alone: without it they would change nothing
    command.add_option("--scene", o->scene, "Scene of the file").needs(prove).reads();
    command
        .add_option("--crop", o->crop,
                    "Crop window of the proof, as fractions of the image, origin bottom left")
        .expected(4)
        .type_name("X0 X1 Y0 Y1")
        .needs(prove);
    command.add_option("--spp", o->spp, "Samples per pixel of the proof")
        .default_text("that of the file")
        .range(uint64_t(1), uint64_t(1) << 32)
        .needs(prove);
    command.add_option("--velatura", o->program, "Renderer program")
        .type_name("FILE")
        .default_text("velatura beside this program")
        .needs(prove);
    command
        .add_option("--render-args", o->more_arguments,
                    "Further options of `velatura render`, which override those of the file, e.g. "
                    "'--search-path textures'")
        .needs(prove);
    command.example("velatura-comp bake shot.exr --gain key=+1st -o key.usda");
    command.callback([&run, o] { run = [o] { return run_bake(*o); }; });
}

}  // namespace velatura::compositor::cli
