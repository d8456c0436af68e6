// SPDX-License-Identifier: Apache-2.0
#include "app/render_arguments.h"

#include "app/memory_options.h"
#include "app/scene_loader.h"
#include "film/film.h"
#include "image/compression.h"

#include <fmt/format.h>

#include <string>
#include <vector>

namespace velatura::app {

namespace {

std::vector<std::string> compression_names() {
    std::vector<std::string> names;
    for (const auto& [name, compression] : image::compression_table) names.emplace_back(name);
    return names;
}

/// What to render.
void declare_scene_options(Command scene, RenderArguments& a) {
    scene.add_option("-c,--camera", a.camera, "Camera prim path")
        .default_text("the render settings', else the first camera, else one that frames the scene")
        .type_name("PRIM")
        .common();
    scene
        .add_option("-s,--settings", a.settings,
                    "RenderSettings prim path, or a RenderPass that names one")
        .default_text("renderSettingsPrimPath")
        .type_name("PRIM");
    scene
        .add_option("--pass", a.pass,
                    "RenderPass prim path: its collections choose what is rendered, seen by the "
                    "camera, held out and pruned; its renderSource names the settings")
        .default_text("none")
        .type_name("PRIM");
    scene
        .add_option("-f,--frames", a.frames,
                    "Frames, e.g. 1-10x2,15; `default` is the default time, without time samples")
        .default_text("startTimeCode of the stage, else 0")
        .type_name("LIST")
        .not_empty()
        .common();
    scene
        .add_option("--purpose", a.purposes,
                    "Purposes to render besides `default`, separated by ','")
        .delimiter(',')
        .one_of({"default", "render", "proxy", "guide"});
    scene
        .add_option("--material-purpose", a.material_purpose,
                    "Material binding purpose; a prim without such a binding uses allPurpose")
        .default_text("the render settings', else full")
        .one_of({"full", "preview", "allPurpose"});
    scene
        .add_option("--working-space", a.working_space,
                    "Linear RGB color space of the render and its file: lin_rec709, acescg, "
                    "lin_rec2020, lin_p3d65, lin_adobergb, aces2065-1, or another name of these")
        .default_text("the render settings' renderingColorSpace, else lin_rec709")
        .type_name("SPACE")
        .not_empty();
    add_search_path_option(scene, a.assets.search_paths);
    add_override_options(scene, a.assets.overrides);
}

/// Where to, and in which form.
void declare_output_options(Command output, RenderArguments& a) {
    output
        .add_option("-o,--output", a.output,
                    "Output file, .exr; #### (or %04d, $F4, <F4>) is the frame number")
        .default_text("the scene's productName, else SCENE.exr")
        .type_name("FILE")
        .writes()
        .common();
    output.add_option("--res", a.resolution, "Resolution in pixels; 320x180 or 320 180")
        .size(65536)
        .default_text("the render settings', else 2048x1080")
        .common();
    output
        .add_option("--image-width", a.image_width,
                    "Image width in pixels; the height follows from the camera's aperture")
        .range(1, 65536)
        .default_text("")
        .excludes(output.find_option("--res"));
    output.add_option("--crop", a.crop, "Crop window as fractions of the image, origin bottom left")
        .expected(4)
        .type_name("X0 X1 Y0 Y1")
        .common();
    output
        .add_option("--exr-layout", a.exr_layout,
                    "EXR parts: multipart (one part per AOV set), single (one part), split (one "
                    "file per layer)")
        .one_of({"multipart", "single", "split"});
    output
        .add_option("--exr-compression", a.exr_compression,
                    "Lossless EXR compression: zip packs 16 rows at a time, zips one, piz is "
                    "wavelets")
        .one_of(compression_names());
    output.add_flag("--float-layers", a.float_layers, "Store light layers as float, not half");
}

void declare_quality_options(Command quality, RenderArguments& a) {
    quality.add_option("--spp", a.spp, "Samples per pixel")
        .range(uint64_t(1), uint64_t(1) << 32)
        .default_text(fmt::format("{}, unlimited with --time, {} with --target-error", default_spp,
                                  max_target_spp))
        .common();
    quality
        .add_option("--time", a.time,
                    "Time limit of a progressive render, e.g. 90s, 10m; without --spp it alone "
                    "ends the render")
        .type_name("TIME")
        .not_empty()
        .common();
    quality
        .add_option("--target-error", a.target_error,
                    fmt::format("Relative standard error at which a progressive render stops, e.g. "
                                "1%; without --spp and --time it stops at {} spp at the latest",
                                max_target_spp))
        .type_name("ERROR")
        .not_empty()
        .common();
    quality.add_flag("--require-target", a.requires_target,
                     "Exit code 3 where --target-error (without it, the samples of --spp or "
                     "--samples) is not reached; a lower bound of the error does not reach it");
    quality
        .add_option("--forecast", a.forecast,
                    "Relative standard error for which to predict spp and time, without stopping "
                    "there; progressive, up to 10 times the samples (docs/reference/accuracy.md)")
        .type_name("ERROR")
        .not_empty();
    quality
        .add_option("--adaptive", a.adaptive,
                    "Adaptive sampling: more samples for noisy pixels, --spp on average; off: "
                    "--spp in every pixel")
        .one_of({"on", "off"});
    quality
        .add_option("--max-depth", a.max_depth,
                    "Maximum bounces of a path (biased); 0 = no maximum, Russian roulette ends "
                    "paths")
        .range(0, 65536)
        .common();
    quality
        .add_option("--caustics", a.caustics,
                    "Caustics: path (path tracing only), light (light tracing as well), auto "
                    "(light tracing where trial paths predict a gain), manifold (manifold "
                    "sampling), small-lights (manifold sampling for small lights)")
        .one_of({"path", "light", "auto", "manifold", "small-lights"});
    constexpr double min_clamp = 1e-30, max_clamp = 1e30;
    quality
        .add_option("--clamp-direct", a.clamp_direct,
                    "Firefly clamp (biased) of b0 and b1: maximum channel of one contribution; "
                    "clamp_ layers keep what it removes")
        .range(min_clamp, max_clamp)
        .default_text("off")
        .common();
    quality
        .add_option("--clamp-indirect", a.clamp_indirect,
                    "Firefly clamp (biased) of b2 and later, e.g. 2; as --clamp-direct")
        .range(min_clamp, max_clamp)
        .default_text("off")
        .common();
    quality
        .add_option("--firefly-guard", a.firefly_guard,
                    "Chooses --clamp-indirect by trial paths before the render (biased): the limit "
                    "with the smallest error at the samples per pixel of the render, or at N")
        .type_name("off|auto|N")
        .common();
    quality.add_option("--filter", a.filter, "Pixel filter")
        .one_of({"box", "triangle", "gaussian", "blackman-harris", "mitchell"});
    quality.add_option("--seed", a.seed, "Random seed; another seed gives other noise")
        .non_negative();
    quality
        .add_option("--texture-bias", a.texture_bias,
                    "Mip bias: textures are filtered over 2^X ray footprints; above 0 blurs, below "
                    "0 sharpens and aliases until enough samples are taken")
        .range(-16.0, 16.0);
    quality
        .add_option("--dicing-rate", a.dicing_rate,
                    "Edge length in pixels of diced subdivision surfaces, 8 times that out of "
                    "view")
        .range(0.05, 1e4);
    quality
        .add_option("--subdivision-level", a.subdivision_level,
                    "Fixed subdivision level, instead of --dicing-rate: each edge is split into "
                    "2^N")
        .range(0, 12);
    quality
        .add_option("--dicing-limit", a.dicing_limit,
                    "Maximum diced triangles in millions; above it all surfaces are diced more "
                    "coarsely, with a warning")
        .range(0.001, 2000.0);
}

void declare_layer_options(Command layers, RenderArguments& a) {
    layers
        .add_option("--bounces", a.bounces,
                    "Bounce layers b0…bK, and `tail` for all later bounces; auto: up to the last "
                    "of b0…b6 with 1 % of the light, auto=S with the share S")
        .type_name("K|auto[=S]")
        .common();
    layers
        .add_option(
            "--lights", a.lights,
            "Light-group AOVs: per-light (named groups, and one per other light), groups (named "
            "groups, all other lights are `rest`), off (all lights are `rest`)")
        .one_of({"per-light", "groups", "off"})
        .common();
    layers
        .add_option(
            "--layers", a.layers,
            "AOV sets, of bounce, light, matrix, shadow, caster, lobe, lobe-matrix, data, or none; "
            "and data layers as [NAME=]SOURCE[:FILTER], e.g. Neye, primvar:Pref, Z:min, motion")
        .type_name("LIST")
        .common();
    layers
        .add_option("--casters", a.casters,
                    "Shadow casters with layers of their own (--layers …,caster), as a path "
                    "expression, e.g. /World/Trees/* or //Vase; the others are `rest`")
        .type_name("PATTERN")
        .expected(1)
        .take_all()
        .default_text("chosen by the names, models and prims of the scene");
    layers
        .add_option("--lpe", a.lpe,
                    "AOV of a light path expression, e.g. dd=C<RD>L, key2=C.{2}<L.'key'>, "
                    "u=unoccluded;C.L (docs/reference/light_path_expressions.md)")
        .type_name("NAME=EXPRESSION")
        .expected(1)
        .take_all()
        .common();
    layers.add_flag("--lpe-strict", a.strict_lpe,
                    "OSL letters in light path expressions: G is glossy and S is a mirror, "
                    "instead of either for any specular");
    layers
        .add_flag("--halves", a.halves,
                  "Half images: two independent halves of every layer, for noise prediction and "
                  "denoising")
        .common();
    layers
        .add_option("--cryptomatte", a.cryptomatte,
                    "Cryptomattes, separated by commas: object (by prim path), material, asset")
        .type_name("LIST")
        .common();
    layers
        .add_option("--cryptomatte-levels", a.matte_levels,
                    "Cryptomatte depth: IDs stored per pixel, by coverage")
        .range(1, 64)
        .default_text("6");
    layers
        .add_option("--cryptomatte-through", a.matte_through,
                    "Surfaces that Cryptomattes pass: refraction (clear glass), reflection "
                    "(mirrors), or both with a comma; their pixels get the IDs of what is seen by "
                    "way of them")
        .type_name("LIST");
    layers.add_flag("--deep", a.deep,
                    "Deep image: also write FILE.deep.exr, color and alpha by depth");
    layers
        .add_option("--deep-samples", a.deep_samples,
                    "Maximum deep samples per pixel; above it the nearest to each other are merged")
        .range(1, 1024)
        .default_text(std::to_string(film::DeepOptions{}.max_samples));
}

void declare_resume_options(Command resume, RenderArguments& a) {
    resume
        .add_flag("--resume", a.resume,
                  "Continue the output file to more --spp or a lower --target-error, bit for bit "
                  "as one render of all samples; start one if there is no file. Refuses another "
                  "scene or other settings (exit code 5)")
        .common();
    resume
        .add_flag("--resumable,--keep-sums", a.is_resumable,
                  "Resumable output: store the exact sums that --resume and merge need (about 3 "
                  "times the size)")
        .former_name("--keep-sums")
        .common();
    resume
        .add_option("--checkpoint", a.checkpoint,
                    "Checkpoint interval of a progressive render, e.g. 5m: write the file with its "
                    "sums, for --resume")
        .type_name("TIME")
        .not_empty();
    resume
        .add_option("--snapshot", a.snapshot,
                    "Preview interval of a progressive render, e.g. 10s: write an interim image "
                    "that --resume can continue; the final file needs --resumable for that")
        .type_name("TIME")
        .not_empty();
    resume
        .add_option("--samples", a.samples,
                    "Sample range A:B of each pixel, to render one frame on several machines; join "
                    "the files with `velatura-comp merge`")
        .type_name("A:B")
        .not_empty()
        .common();
    resume
        .add_option("--rates-from", a.rates_from,
                    "First part of the frame, with --samples: take the rates of adaptive sampling "
                    "from it instead of tracing the pilot samples again; same image")
        .type_name("FILE.exr")
        .not_empty()
        .reads();
    resume
        .add_option("--for-mix", a.for_mix,
                    "Request of `velatura-comp request`, with --resume: place the further samples "
                    "where a mix is noisy; --spp (average) overrides that of the request")
        .type_name("FILE.json")
        .reads();
}

void declare_report_options(Command report, RenderArguments& a) {
    report
        .add_option("--display", a.display,
                    "Show the image in the viewer tev while it renders; port 14158 by default")
        .type_name("HOST[:PORT]|[IPV6]:PORT")
        .default_text("no viewer");
    report
        .add_option("--display-layers", a.display_layers,
                    "Light layers that --display sends beside the beauty, e.g. b1,C_key")
        .type_name("LIST")
        .default_text("none");
    report
        .add_option("--preview", a.preview,
                    "Preview image for people, replaced during the render: .png, .jpg, .tif "
                    "of the beauty on the default display; one file for all frames")
        .type_name("FILE.png")
        .writes();
    report.add_option("--every", a.every, "Interval of --preview and of images in the terminal")
        .type_name("TIME")
        .default_text("5s")
        .not_empty();
    report
        .add_option("--progress", a.progress,
                    "Progress format; bar prints lines where there is no terminal, image shows the "
                    "image in a terminal that can (kitty or sixel protocol, which can be named "
                    "instead)")
        .one_of({"bar", "json", "openjd", "image", "kitty", "sixel", "none"})
        .common();
    report.add_option("--stats", a.stats, "Statistics file, JSON; one per frame, named as -o")
        .type_name("FILE")
        .writes()
        .common();
    report.add_flag("-q,--quiet", a.quiet, "Print errors only").common();
    report.add_flag("-v,--verbose", a.verbosity, "Print more");
    report.add_flag(
        "--strict", a.strict,
        "Render nothing if the scene has errors or needs a missing plugin; exit code 4 if a "
        "sample is bad");
    report.add_flag("--require-assets", a.requires_assets,
                    "Render nothing if an asset or a plugin is missing that can be found so before "
                    "the first sample; exit code 1");
    report
        .add_option("--missing-textures,--texture-failure", a.missing_textures,
                    "Missing or unreadable textures: fallback (use the fallback color, and count "
                    "them) or error (do not render; exit code 1 where it is found during the "
                    "render)")
        .one_of({"fallback", "error"})
        .synonym("color", "fallback")
        .synonym("colour", "fallback")
        .former_name("--texture-failure");
    report
        .add_option("--replay", a.replay,
                    "Trace sample S of pixel X,Y alone, or all its samples, and print their paths")
        .type_name("X,Y[,S]")
        .not_empty();
    report
        .add_option("--paths", a.paths,
                    "With --replay: write the light paths to a file, .json, or .usda for viewers")
        .type_name("FILE")
        .not_empty()
        .writes();
}

void declare_machine_options(Command machine, RenderArguments& a) {
    machine
        .add_option("--threads", a.threads,
                    "Number of threads, 0 = all cores; the image does not depend on it")
        .range(0, 1024)
        .common();
    add_memory_option(machine, a.memory_limit).common();
    machine
        .add_option("--volume-memory", a.volume_memory_gb,
                    "Memory limit of volume grids in GB; a volume above it is skipped with an "
                    "error")
        .range(0.001, 1e6)
        .default_text("half of the machine's memory");
    machine
        .add_option("--instance-limit", a.instance_limit,
                    "Maximum instances in millions, nested ones counted; above it the prims with "
                    "most instances are skipped with an error, until at most one million remain")
        .range(0.000001, 4000.0)
        .default_text("50, or what half of the machine's memory holds");
    machine
        .add_option("--mode", a.mode,
                    "Order of work: progressive (whole-frame passes that double) or tile (all "
                    "samples of a tile at once); same image")
        .one_of({"progressive", "tile"});
    machine
        .add_option("--tile", a.tile,
                    fmt::format("Tile size in pixels, rounded up to a multiple of {}",
                                film::Film::tile_size))
        .range(1, 4096);
    machine
        .add_option(
            "--accel", a.accel,
            "Ray-intersection backend: bvh, or one of a plugin (embree); same image but for "
            "rounding of hits")
        .type_name("NAME");
    machine
        .add_option("--bvh-quality", a.bvh_quality,
                    "BVH build quality; auto decides by the expected number of rays; same image")
        .one_of({"auto", "fast", "balanced", "high"});
    machine
        .add_option("--volume-bounds", a.volume_bounds,
                    "Majorants of volumes: bricks (one per brick of voxels) or one (for the whole "
                    "volume); same mean")
        .one_of({"bricks", "one"});
}

void declare_sampling_options(Command sampling, RenderArguments& a) {
    sampling
        .add_option("--guiding", a.guiding,
                    "Path guiding, learned from trial paths before the render; auto uses it where "
                    "they predict a gain")
        .one_of({"off", "auto", "on"});
    sampling
        .add_option("--splitting", a.splitting,
                    "Path splitting: auto makes up to 4 branches at the first non-specular hit, "
                    "where trial paths predict a gain; off makes one")
        .one_of({"auto", "off"});
    sampling
        .add_option("--sampler", a.sampler,
                    "Sample points: sobol (Owen-scrambled), blue-noise (as good, and errors cancel "
                    "among neighboring pixels), stratified, or independent")
        .one_of({"sobol", "blue-noise", "stratified", "independent"});
    sampling
        .add_option("--effects", a.effects,
                    "Features: -NAME switches one off (`velatura plan` lists them), all forces "
                    "every feature on (same image, slower)")
        .type_name("[all][,-NAME]");
}

void declare_classic_options(Command classic, RenderArguments& a) {
    classic
        .add_option(
            "--integrator", a.integrator,
            "Integrator: path (light and BSDF sampling by MIS), nee (light sampling), naive "
            "(BSDF sampling), whitted (direct light and mirror chains: another image)")
        .one_of({"path", "nee", "naive", "whitted"});
    classic
        .add_option("--light-sampling", a.light_sampling,
                    "Direct-lighting strategy: mis, light (solid angle), area (of one light), "
                    "global-area (of all lights), hemisphere, cosine, or bsdf")
        .one_of({"mis", "light", "area", "global-area", "hemisphere", "cosine", "bsdf"})
        .default_text("that of the integrator");
    classic.add_option("--light-selection", a.light_selection, "Light selection of direct lighting")
        .one_of({"uniform", "power", "area", "tree"})
        .default_text("tree, area for global-area");
    classic
        .add_option(
            "--roulette", a.roulette,
            "Russian roulette: by throughput, surface albedo, efficiency (measured by trial "
            "paths), constant, cutoff (biased, see --cutoff), or none (needs --max-depth)")
        .one_of({"throughput", "albedo", "efficiency", "constant", "cutoff", "none"});
    classic
        .add_option("--cutoff", a.cutoff,
                    "Throughput, relative to the start of the path, below which --roulette cutoff "
                    "terminates it")
        .range(1e-9, 1.0)
        .default_text("0.01");
}

}  // namespace

void declare_render_options(Command& command, RenderArguments& a) {
    command.add_option("scene", a.scene, "USD scene (.usda, .usdc, .usd, .usdz)")
        .required()
        .reads();
    declare_scene_options(command.add_group("Scene"), a);
    declare_output_options(command.add_group("Output"), a);
    declare_quality_options(command.add_group("Quality"), a);
    declare_layer_options(command.add_group("Light layers"), a);
    declare_resume_options(command.add_group("Resume and farm"), a);
    declare_report_options(command.add_group("Progress and reports"), a);
    declare_machine_options(command.add_group("Speed and memory"), a);
    Command assets = command.add_group("Files and limits");
    add_root_options(assets, a.assets);
    declare_sampling_options(command.add_group("Sampling"), a);
    declare_classic_options(command.add_group("Classic estimators"), a);
}

}  // namespace velatura::app
