// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"
#include "compositor/controls.h"
#include "compositor/diff.h"
#include "compositor/info.h"
#include "compositor/layer_stack.h"
#include "compositor/merge.h"
#include "compositor/mix.h"
#include "image/digest.h"
#include "image/layer_check.h"
#include "image/layer_file.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using namespace velatura;
using compositor::Control;

/// DESIGN §5.
enum ExitCode { done = 0, failed = 1, usage = 2, check_failed = 4, refused = 5 };

int report(const Error& error) {
    fmt::print(stderr, "velatura-comp: error: {} [{}]\n", error.message, error.code);
    if (error.code == "bad-gain" || error.code == "unknown-name") return usage;
    if (error.code == "closure-failed" || error.code == "verify-failed") return check_failed;
    return error.code == "merge-refused" ? refused : failed;
}

struct InfoOptions {
    std::string file;
    bool hash = false, json = false;
};

int run_info(const InfoOptions& o) {
    if (o.hash) {
        const auto image = image::read_layer_file(o.file);
        if (!image) return report(image.error());
        fmt::print("{}\n", image::digest_of(*image));
        return done;
    }
    const auto stack = compositor::LayerStack::load(o.file);
    if (!stack) return report(stack.error());
    fmt::print("{}", o.json ? compositor::info_json(*stack) : compositor::info_text(*stack));
    return done;
}

struct MixOptions {
    std::string input, output, preset, save_preset, display, view;
    std::vector<std::pair<Control::Kind, std::string>>
        controls;  ///< in the order of the command line
    float exposure = 0;
    bool with_layers = false;
};

bool ends_with_any(const std::string& path, std::initializer_list<const char*> extensions) {
    std::string lower = path;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const char* e) { return lower.ends_with(e); });
}

Result<compositor::Look> look_of(const MixOptions& o) {
    compositor::Look look;
    if (!o.preset.empty()) {
        const auto text = read_file(o.preset, size_t(1) << 24);
        if (!text) return text.error();
        auto loaded = compositor::look_from_json(*text);
        if (!loaded) return Error{loaded.error().code, o.preset + ": " + loaded.error().message};
        look = std::move(*loaded);
    }
    for (const auto& [kind, text] : o.controls) {
        auto control = compositor::parse_control(kind, text);
        if (!control) return control.error();
        look.controls.push_back(std::move(*control));
    }
    look.exposure_stops += o.exposure;
    if (!o.display.empty()) look.display = o.display;
    if (!o.view.empty()) look.view = o.view;
    return look;
}

int run_mix(const MixOptions& o) {
    const bool is_display = ends_with_any(o.output, {".png", ".jpg", ".jpeg"});
    if (!is_display && !ends_with_any(o.output, {".exr"})) {
        fmt::print(stderr, "velatura-comp: error: {} is not .exr, .png or .jpg [bad-output]\n",
                   o.output);
        return usage;
    }
    const auto look = look_of(o);
    if (!look) return report(look.error());
    const auto stack = compositor::LayerStack::load(o.input);
    if (!stack) return report(stack.error());
    const auto plan = compositor::plan_mix(*stack, *look);
    if (!plan) return report(plan.error());
    const image::Image mixed =
        compositor::apply_mix(*stack, *plan, *look, o.with_layers && !is_display);
    const auto written = is_display ? compositor::write_display(o.output, mixed, *look)
                                    : image::write_image_file(o.output, mixed);
    if (!written) return report(written.error());
    if (!o.save_preset.empty()) {
        if (auto saved = write_file_atomically(o.save_preset, compositor::look_to_json(*look));
            !saved) {
            return report(saved.error());
        }
    }
    return done;
}

int run_verify(const std::string& file, bool quiet) {
    const auto stack = compositor::LayerStack::load(file);
    if (!stack) {
        const int code = report(stack.error());
        // A file that opens but whose header or pixels are broken has failed the check
        return stack.error().code == "io-open" ? code : int(check_failed);
    }
    const image::LayerCheck check = image::check_layers(stack->image(), stack->header());
    for (const std::string& problem : check.problems) {
        fmt::print(stderr, "velatura-comp: error: {}: {} [verify-failed]\n", file, problem);
    }
    if (!check.is_good()) return check_failed;
    if (!quiet) {
        fmt::print("{}: {} layers, {} channels\n", file, check.layers, check.channels);
        for (const image::FamilyClosure& c : check.closure) {
            fmt::print("  {}: {} layers add up to the beauty {}\n", c.family, c.order.size(),
                       c.is_exact
                           ? std::string("bit for bit")
                           : fmt::format("within rounding ({:.3f} of the bound)", c.measured));
        }
    }
    return done;
}

struct DiffOptions {
    std::string a, b, output;
    double threshold = 0;
    bool json = false, quiet = false;
};

void print_difference(const compositor::Difference& difference, bool json) {
    nlohmann::ordered_json j;
    j["schema"] = "velatura.diff/1";
    j["equal"] = difference.is_equal;
    j["worstRelMse"] = difference.worst_rel_mse;
    j["layers"] = nlohmann::ordered_json::array();
    for (const compositor::LayerDifference& d : difference.layers) {
        const char* only = d.only_in_a ? "only in A" : d.only_in_b ? "only in B" : "";
        if (json) {
            j["layers"].push_back({{"name", d.layer},
                                   {"max", d.largest},
                                   {"mean", d.mean},
                                   {"relMse", d.rel_mse},
                                   {"pixels", d.different},
                                   {"at", {d.x, d.y}},
                                   {"only", only}});
        } else if (*only != '\0') {
            fmt::print("{:<24} {}\n", d.layer, only);
        } else {
            fmt::print("{:<24} max {:.6g} at {},{}  mean {:.6g}  relMSE {:.6g}  pixels {}\n",
                       d.layer, d.largest, d.x, d.y, d.mean, d.rel_mse, d.different);
        }
    }
    if (json) fmt::print("{}\n", j.dump(2));
}

int run_diff(const DiffOptions& o) {
    const auto a = image::read_layer_file(o.a);
    if (!a) return report(a.error());
    const auto b = image::read_layer_file(o.b);
    if (!b) return report(b.error());
    const auto difference = compositor::compare(*a, *b);
    if (!difference) {
        report(difference.error());
        return check_failed;
    }
    if (!o.quiet) print_difference(*difference, o.json);
    if (!o.output.empty()) {
        if (auto written = image::write_image_file(o.output, compositor::difference_image(*a, *b));
            !written) {
            return report(written.error());
        }
    }
    if (difference->is_equal) return done;
    bool has_all_layers = true;
    for (const auto& d : difference->layers)
        has_all_layers = has_all_layers && !d.only_in_a && !d.only_in_b;
    const bool is_close =
        o.threshold > 0 && has_all_layers && difference->worst_rel_mse <= o.threshold;
    return is_close ? done : check_failed;
}

struct MergeOptions {
    std::vector<std::string> inputs;
    std::string output;
    bool keep_sums = false;
};

int run_merge(const MergeOptions& o) {
    const auto written = compositor::merge_files(o.inputs, o.output, o.keep_sums);
    if (!written) return report(written.error());
    fmt::print("{}  {}\n", written->sha256, o.output);
    return done;
}

void add_mix(CLI::App& app, MixOptions& o) {
    app.add_option("input", o.input, "File of light layers")->required();
    app.add_option("-o,--output", o.output, "Scene-linear .exr, or .png / .jpg through OpenColorIO")
        ->required();
    const auto control = [&](const char* name, Control::Kind kind, const char* help) {
        app.add_option_function<std::vector<std::string>>(
               name,
               [&o, kind](const std::vector<std::string>& texts) {
                   for (const std::string& text : texts) o.controls.emplace_back(kind, text);
               },
               help)
            ->take_all()
            ->allow_extra_args(false);
    };
    control("--gain", Control::Kind::Gain,
            "NAME=G: factor (2, 0.5) or stops (+1.5st, -1st); repeatable");
    control("--tint", Control::Kind::Tint, "NAME=R,G,B: factor per channel; repeatable");
    control("--kelvin", Control::Kind::Kelvin,
            "NAME=K: tint of a black body against 6504 K; repeatable");
    control("--mute", Control::Kind::Mute, "NAME: take it out; repeatable");
    control("--solo", Control::Kind::Solo, "NAME: take everything else out; repeatable");
    control("--shadow", Control::Kind::Shadow,
            "GROUP=X: lift its shadows by X from 0 to 1; repeatable");
    app.add_option("--exposure", o.exposure, "Stops on everything");
    app.add_option("--preset", o.preset, "Look to start from (JSON)");
    app.add_option("--save-preset", o.save_preset, "Write the look as JSON");
    app.add_option("--display", o.display, "OpenColorIO display for .png and .jpg");
    app.add_option("--view", o.view, "OpenColorIO view: ACES, sRGB or Raw in the built-in config");
    app.add_flag("--with-layers", o.with_layers, "Store the gained layers in the .exr as well");
    app.footer(
        "NAME is a light group, b0, b1, ..., tail, direct (b1), indirect (b2 to tail), env (all "
        "domes), emissive,\n"
        "shadow (a gain on it is the strength that is left), all, or GROUP:BOUNCE.");
}

int run(int argc, char** argv) {
    CLI::App app("Recombines the light layers of a Velatura render.", "velatura-comp");
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 done, 1 file or output error, 2 usage, 4 check failed or files differ, 5 "
        "merge refused.");
    int code = done;

    InfoOptions info;
    CLI::App* info_app =
        app.add_subcommand("info", "What a file holds: layers, groups, energy, samples, closure");
    info_app->add_option("file", info.file, "File of light layers")->required();
    info_app->add_flag("--hash", info.hash, "Print only the SHA-256 of all pixel data");
    info_app->add_flag("--json", info.json, "As JSON");
    info_app->callback([&] { code = run_info(info); });

    MixOptions mix;
    CLI::App* mix_app = app.add_subcommand("mix", "Gains, tints, mute, solo and shadow lift");
    add_mix(*mix_app, mix);
    mix_app->callback([&] { code = run_mix(mix); });

    std::string verify_file;
    bool verify_quiet = false;
    CLI::App* verify_app =
        app.add_subcommand("verify", "Check closure, names, values and digests of a file");
    verify_app->add_option("file", verify_file, "File of light layers")->required();
    verify_app->add_flag("-q,--quiet", verify_quiet, "Print problems only");
    verify_app->callback([&] { code = run_verify(verify_file, verify_quiet); });

    DiffOptions diff;
    CLI::App* diff_app = app.add_subcommand("diff", "Differences per layer; B is the reference");
    diff_app->add_option("a", diff.a, "File A")->required();
    diff_app->add_option("b", diff.b, "File B, the reference")->required();
    diff_app->add_option("--threshold", diff.threshold,
                         "Largest relMSE of any layer that counts as equal; default 0");
    diff_app->add_option("-o,--output", diff.output, "Write A - B as .exr");
    diff_app->add_flag("--json", diff.json, "As JSON");
    diff_app->add_flag("-q,--quiet", diff.quiet, "Only the exit code");
    diff_app->callback([&] { code = run_diff(diff); });

    MergeOptions merge;
    CLI::App* merge_app = app.add_subcommand(
        "merge", "Join renders of adjacent sample ranges into the single render");
    merge_app->add_option("inputs", merge.inputs, "Files rendered with --samples A:B")->required();
    merge_app->add_option("-o,--output", merge.output, "Merged file")->required();
    merge_app->add_flag("--keep-sums", merge.keep_sums, "Keep the exact sums, for another merge");
    merge_app->callback([&] { code = run_merge(merge); });

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? int(done) : int(usage);
    }
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& e) {
        fmt::print(stderr, "velatura-comp: error: {}\n", e.what());
        return failed;
    }
}
