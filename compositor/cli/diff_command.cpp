// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/inspect/diff.h"
#include "compositor/inspect/flip.h"
#include "compositor/io/image_name.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <memory>
#include <optional>
#include <string>

namespace velatura::compositor::cli {

namespace {

struct DiffOptions {
    std::string a, b, output, frames;
    double threshold = 0;
    bool flip = false, json = false, quiet = false;
};

void print_difference(const inspect::Difference& difference,
                      const std::optional<inspect::Flip>& flip,
                      std::optional<int> frame,
                      bool json) {
    nlohmann::ordered_json j;
    j["schema"] = "velatura.diff/1";
    if (frame && json) j["frame"] = *frame;
    if (frame && !json) fmt::print("frame {}\n", *frame);
    j["equal"] = difference.is_equal;
    j["worstRelMse"] = difference.worst_rel_mse;
    j["layers"] = nlohmann::ordered_json::array();
    for (const inspect::LayerDifference& d : difference.layers) {
        const char* only = d.only_in_a ? "only in A" : d.only_in_b ? "only in B" : "";
        if (json) {
            j["layers"].push_back({{"name", d.layer},
                                   {"max", d.largest},
                                   {"mean", d.mean},
                                   {"relMse", d.rel_mse},
                                   {"error", std::sqrt(d.rel_mse)},
                                   {"pixels", d.different},
                                   {"at", {d.x, d.y}},
                                   {"only", only}});
        } else if (*only != '\0') {
            fmt::print("{:<24} {}\n", d.layer, only);
        } else {
            fmt::print(
                "{:<24} max {:.6g} at {},{}  mean {:.6g}  relMSE {:.6g} (error {:.3g} %)  pixels "
                "{}\n",
                d.layer, d.largest, d.x, d.y, d.mean, d.rel_mse, 100 * std::sqrt(d.rel_mse),
                d.different);
        }
    }
    if (flip && json) {
        j["flip"] = {{"mean", flip->mean},
                     {"max", flip->largest},
                     {"exposures", flip->exposures},
                     {"stops", {flip->first_stop, flip->last_stop}}};
    } else if (flip) {
        fmt::print(
            "{:<24} mean {:.6g}  max {:.6g}  at {} exposures from {:+.1f} to {:+.1f} stops\n",
            "HDR-FLIP of rgba", flip->mean, flip->largest, flip->exposures, flip->first_stop,
            flip->last_stop);
    }
    if (json) fmt::print("{}\n", j.dump(2));
}

/// Of the beauties.
Result<inspect::Flip> beauty_flip(const image::Image& a, const image::Image& b) {
    const auto test = inspect::planes_of(a, "rgba"), reference = inspect::planes_of(b, "rgba");
    if (!test) return test.error();
    if (!reference) return reference.error();
    return inspect::hdr_flip(*reference, *test);
}

int diff_one(const DiffOptions& o, std::optional<int> frame) {
    const auto a = layers::read_layer_file(o.a);
    if (!a) return report(a.error());
    const auto b = layers::read_layer_file(o.b);
    if (!b) return report(b.error());
    const auto difference = inspect::compare(*a, *b);
    if (!difference) {
        report(difference.error());
        return check_failed;
    }
    std::optional<inspect::Flip> flip;
    if (o.flip || is_display_image(o.output)) {
        auto seen = beauty_flip(*a, *b);
        if (!seen) return report(seen.error());
        flip = std::move(*seen);
    }
    if (!o.quiet) print_difference(*difference, flip, frame, o.json);
    if (!o.output.empty()) {
        const auto written =
            is_display_image(o.output)
                ? inspect::write_flip_image(o.output, a->data, flip->map)
                : layers::write_image_file(o.output, inspect::difference_image(*a, *b));
        if (!written) return report(written.error());
    }
    if (difference->is_equal) return done;
    bool has_all_layers = true;
    for (const auto& d : difference->layers)
        has_all_layers = has_all_layers && !d.only_in_a && !d.only_in_b;
    const bool is_close =
        o.threshold > 0 && has_all_layers && difference->worst_rel_mse <= o.threshold;
    return is_close ? done : check_failed;
}

int run_diff(const DiffOptions& o) {
    if (!o.output.empty() && !is_exr(o.output) && !is_display_image(o.output))
        return report({"bad-output", o.output + " is not " + image_names()});
    return run_frames({{o.a, o.b}, {o.output}, o.frames}, [&](const FrameNames& names) {
        DiffOptions one = o;
        one.a = names.input(o.a);
        one.b = names.input(o.b);
        one.output = names.output(o.output);
        return diff_one(one, names.frame());
    });
}

}  // namespace

void add_diff_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<DiffOptions>();
    Command command =
        app.add_subcommand("diff", "Compare two files layer by layer; B is the reference");
    command.add_option("a", o->a, "File A, or shot.####.exr").required().reads();
    command.add_option("b", o->b, "File B, the reference").required().reads();
    command
        .add_option("--threshold", o->threshold,
                    "Maximum relMSE of equal layers; alpha has its own line")
        .non_negative();
    command
        .add_option("-o,--output", o->output,
                    "Difference image: A - B as .exr, or the error map of --flip as .png or .jpg")
        .type_name("FILE")
        .writes();
    add_frames_option(command, o->frames);
    command.add_flag("--flip", o->flip, "Perceived difference of the beauties, 0 to 1 (HDR-FLIP)");
    Option json = command.add_flag("--json", o->json, "Print JSON");
    command.add_flag("-q,--quiet", o->quiet, "Print nothing: exit code 0 if equal, 4 if not")
        .excludes(json);
    command.example("velatura-comp diff new.exr reference.exr --threshold 1e-6");
    command.callback([&run, o] { run = [o] { return run_diff(*o); }; });
}

}  // namespace velatura::compositor::cli
