// SPDX-License-Identifier: Apache-2.0
#include "compositor/cli/command_outcome.h"
#include "compositor/cli/commands.h"
#include "compositor/cli/frame_runs.h"
#include "compositor/inspect/contact_sheet.h"
#include "compositor/io/image_name.h"
#include "compositor/look/controls.h"
#include "image/formats.h"
#include "layers/layer_file.h"

#include <memory>
#include <string>
#include <vector>

namespace velatura::compositor::cli {

namespace {

struct ViewOptions {
    std::string input, output, frames;
    inspect::SheetOptions sheet;
};

int view_one(const ViewOptions& o) {
    const auto image = layers::read_layer_file(o.input);
    if (!image) return report(image.error());
    std::vector<std::string> warnings;
    const auto sheet = inspect::contact_sheet(*image, o.sheet, &warnings);
    if (!sheet) return report(sheet.error());
    for (const std::string& warning : warnings) warn(o.input + ": " + warning);
    const auto written =
        image::write_display_image(o.output, sheet->width(), sheet->height(), sheet->rgb());
    return written ? done : report(written.error());
}

int run_view(const ViewOptions& o) {
    if (!is_display_image(o.output))
        return report({"bad-output",
                       o.output + " is not a display image; expected .png, .jpg, .tif or .dpx"});
    return run_frames({{o.input}, {o.output}, o.frames}, [&](const FrameNames& names) {
        ViewOptions one = o;
        one.input = names.input(o.input);
        one.output = names.output(o.output);
        return view_one(one);
    });
}

}  // namespace

void add_view_command(Command& app, std::function<int()>& run) {
    const auto o = std::make_shared<ViewOptions>();
    Command command = app.add_subcommand("view", "Write a contact sheet of all layers");
    command.add_option("input", o->input, "Any EXR file, or shot.####.exr").required().reads();
    command.add_option("-o,--output", o->output, "Output image, .png or .jpg").required().writes();
    add_frames_option(command, o->frames);
    command.add_option("--layers", o->sheet.patterns, "Layers to show, as patterns with * and ?");
    command.add_flag("--halves", o->sheet.halves,
                     "Show half images too, of the layers that --layers names");
    command.add_flag("--fit", o->sheet.fit,
                     "Automatic exposure per light layer, printed in its caption");
    command
        .add_option("--exposure", o->sheet.exposure_stops, "Exposure of the light layers, in stops")
        .range(-largest_stops, largest_stops);
    command.add_option("--columns", o->sheet.columns, "Layers per row")
        .default_text("as wide as a monitor")
        .range(1, 1000);
    command
        .add_option("--width", o->sheet.cell_width,
                    "Width of a layer in pixels, reduced for very many layers")
        .default_text("320")
        .range(32, 4096);
    command.add_option("--display", o->sheet.display, "OpenColorIO display").type_name("NAME");
    command.add_option("--view", o->sheet.view, "OpenColorIO view").type_name("NAME");
    command
        .add_option("--input-space", o->sheet.input_space,
                    "Color space of the file, overrides its header")
        .type_name("SPACE");
    command.example("velatura-comp view shot.exr -o sheet.png --fit");
    command.callback([&run, o] { run = [o] { return run_view(*o); }; });
}

}  // namespace velatura::compositor::cli
