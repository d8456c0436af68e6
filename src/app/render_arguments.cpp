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

}  // namespace

void declare_render_options(Command& command, RenderArguments& a) {
    command.add_option("scene", a.scene, "USD scene (.usda, .usdc, .usd, .usdz)")
        .required()
        .reads();
    add_search_path_option(command, a.assets.search_paths);
    add_root_options(command, a.assets);
    add_override_options(command, a.assets.overrides);
    add_memory_option(command, a.memory_limit);
    command
        .add_option(
            "-o,--output", a.output,
            "file, .exr; #### (or %04d, $F4, <F4>) stands for the frame, which several frames get "
            "before "
            "the extension without it (default: the scene's productName, else SCENE.exr)")
        .writes();

    Command what = command.add_group("What to render");
    what.add_option("-c,--camera", a.camera,
                    "prim path of the camera (default: the render settings', else the first "
                    "camera, else one that frames everything)");
    what.add_option("-s,--settings", a.settings,
                    "prim path of the RenderSettings, or of a RenderPass that names them (default: "
                    "renderSettingsPrimPath)");
    what.add_option("-f,--frames", a.frames,
                    "frames such as 1-10x2,15, or `default` for the default time, where samples "
                    "do not count (default: the stage's startTimeCode, else 0)")
        .not_empty();
    what.add_option("--res", a.resolution, "width and height in pixels; 320x180 is 320 180")
        .size(65536);
    what.add_option("--crop", a.crop, "part of the picture as fractions, origin bottom left")
        .expected(4)
        .type_name("X0 X1 Y0 Y1");
    what.add_option("--purpose", a.purposes,
                    "purposes to include besides default: render, proxy, guide")
        .delimiter(',')
        .one_of({"default", "render", "proxy", "guide"});
    what.add_option("--material-purpose", a.material_purpose,
                    "material bindings to render: full, preview, allPurpose; those of all purposes "
                    "where a prim has no such one (default: the render settings', else full)")
        .one_of({"full", "preview", "allPurpose"});

    Command how = command.add_group("How long and how well");
    how.add_option(
           "--mode", a.mode,
           "progressive: whole-frame passes that double; tile: each tile at once; same picture")
        .one_of({"progressive", "tile"});
    how.add_option("--tile", a.tile,
                   fmt::format("pixels along the side of a tile, rounded up to a multiple of {}",
                               film::Film::tile_size))
        .range(1, 4096);
    how.add_option("--spp", a.spp,
                   fmt::format("samples per pixel (default {}; with --time no limit, with "
                               "--target-error {})",
                               default_spp, max_target_spp))
        .range(uint64_t(1), uint64_t(1) << 32);
    how.add_option("--adaptive", a.adaptive,
                   "on: noisy parts of the picture get more samples and clean ones fewer, --spp "
                   "in the mean; off: every pixel gets --spp")
        .one_of({"on", "off"});
    how.add_option(
           "--samples", a.samples,
           "only samples A:B of each pixel; the file can be merged with `velatura-comp merge`")
        .type_name("A:B")
        .not_empty();
    how.add_flag("--keep-sums", a.keep_sums,
                 "keep the exact sums in the file, so that --resume can go on from it (about 3 "
                 "times the size)");
    how.add_flag("--resume", a.resume,
                 "go on from the output file, if it is there, to more --spp or a lower "
                 "--target-error: the file that one render of all samples writes. Keeps the sums; "
                 "refuses another scene or other settings (exit 5)");
    how.add_option(
           "--for-mix", a.for_mix,
           "with --resume: place the further samples where a mix is noisy, as the request "
           "says that `velatura-comp request` wrote; --spp, in the mean, beats the request's")
        .type_name("FILE.json")
        .reads();
    how.add_option(
           "--time", a.time,
           "progressive: stop after this time, e.g. 90s, 10m; without --spp the time alone decides")
        .not_empty();
    how.add_option("--target-error", a.target_error,
                   fmt::format("progressive: stop at this relative standard error, e.g. 1%; "
                               "without --spp and --time at {} samples per pixel at the latest",
                               max_target_spp))
        .not_empty();
    how.add_flag("--require-target", a.requires_target,
                 "exit code 3 if --target-error or, without it, the samples of --spp or --samples "
                 "were not reached; an error that is a lower bound does not reach a target");
    how.add_option(
           "--forecast", a.forecast,
           "progressive: say how many samples and how much time would bring this relative standard "
           "error, without stopping at it; up to 8 times the samples (docs/reference/accuracy.md)")
        .not_empty();
    how.add_option(
           "--max-depth", a.max_depth,
           "cut paths after this many scatterings, a bias; 0 = only Russian roulette ends paths")
        .range(0, 65536);
    how.add_option("--dicing-rate", a.dicing_rate,
                   "subdivision surfaces are cut into triangles with edges of about this many "
                   "pixels, 8 times that out of the picture")
        .range(0.05, 1e4);
    how.add_option("--subdivision-level", a.subdivision_level,
                   "instead: every edge of a subdivided mesh is cut into 2^N pieces")
        .range(0, 12);
    how.add_option("--dicing-limit", a.dicing_limit,
                   "million triangles that subdivision surfaces may become; above that all are "
                   "cut more coarsely, with a warning")
        .range(0.001, 2000.0);
    how.add_option("--texture-bias", a.texture_bias,
                   "textures are filtered over 2^N times the footprint of a ray: above 0 blurs, "
                   "below 0 sharpens and leaves more to the samples")
        .range(-16.0, 16.0);
    how.add_option("--volume-bounds", a.volume_bounds,
                   "how the densest place ahead is known in volumes: bricks: brick by brick of "
                   "the grid; one: by one number for the whole volume; the same mean")
        .one_of({"bricks", "one"});
    how.add_option("--volume-memory", a.volume_memory_gb,
                   "GB that grids of volumes may take (default: half of the machine's memory); a "
                   "volume that needs more is left out with an error")
        .range(0.001, 1e6);
    how.add_option(
           "--instance-limit", a.instance_limit,
           "million instances that a scene may come to, nested ones counted; if it comes to more, "
           "the prims that ask for most are left out with an error, until at most one million "
           "remains (default: 50, or what half of the machine's memory holds)")
        .range(0.000001, 4000.0);
    how.add_option("--filter", a.filter, "pixel filter")
        .one_of({"box", "triangle", "gaussian", "blackman-harris", "mitchell"});
    how.add_option("--seed", a.seed, "another seed gives other noise").non_negative();
    how.add_option("--threads", a.threads,
                   "threads; 0 = all cores; the picture does not depend on it")
        .range(0, 1024);
    how.add_option("--accel", a.accel,
                   "what finds where rays meet triangles: bvh, or one that a plugin brings "
                   "(embree); the same picture but for ties and the last bits of distances");
    how.add_option("--bvh-quality", a.bvh_quality,
                   "time that goes into building the own tree: fast, balanced, high, or auto: by "
                   "the expected number of rays; the same picture")
        .one_of({"auto", "fast", "balanced", "high"});

    Command estimator = command.add_group("Estimator, to compare with the classic ones");
    estimator
        .add_option(
            "--integrator", a.integrator,
            "path: light and BSDF sampling by MIS; nee: light sampling alone; naive: BSDF sampling "
            "alone; whitted: direct light and mirror chains only, another picture")
        .one_of({"path", "nee", "naive", "whitted"});
    estimator
        .add_option("--light-sampling", a.light_sampling,
                    "who looks for lights: mis; light: by solid angle; area: by area of one "
                    "light; global-area: by area of all lights; hemisphere or cosine: by a "
                    "direction of the vertex's own, uniform or by the cosine; bsdf: where paths "
                    "go on (default: as the integrator says)")
        .one_of({"mis", "light", "area", "global-area", "hemisphere", "cosine", "bsdf"});
    estimator
        .add_option("--light-selection", a.light_selection,
                    "how a light is picked for direct light (default: tree; of global-area: area)")
        .one_of({"uniform", "power", "area", "tree"});
    estimator
        .add_option("--roulette", a.roulette,
                    "how paths end: by their throughput, by what each surface reflects, by what "
                    "trial paths say that ending them saves, with a constant chance, below "
                    "--cutoff (a bias), or not (needs --max-depth)")
        .one_of({"throughput", "albedo", "efficiency", "constant", "cutoff", "none"});
    estimator
        .add_option("--cutoff", a.cutoff,
                    "of --roulette cutoff: paths end that carry less than this part of what they "
                    "began with (default 0.01)")
        .range(1e-9, 1.0);
    estimator
        .add_option("--guiding", a.guiding,
                    "learn from trial paths where light comes from: off, on, or auto: where the "
                    "trial says that it pays")
        .one_of({"off", "auto", "on"});
    estimator
        .add_option("--splitting", a.splitting,
                    "auto: paths divide into up to 4 branches at the first surface that spreads "
                    "light, as many as trial paths say that pay there; off: they go on by one")
        .one_of({"auto", "off"});
    estimator
        .add_option("--caustics", a.caustics,
                    "light through smooth glass and off mirrors: path = met by chance, manifold = "
                    "solved for, auto = solved for where lights are small")
        .one_of({"path", "manifold", "auto"});
    estimator
        .add_option("--sampler", a.sampler,
                    "points of a pixel: Owen-scrambled Sobol', the same with errors that cancel "
                    "among neighbours, jittered strata, or independent random ones")
        .one_of({"sobol", "blue-noise", "stratified", "independent"});

    estimator
        .add_option("--effects", a.effects,
                    "-NAME leaves an effect out (velatura plan lists them), all lets those run "
                    "too that nothing calls for: the same picture, later")
        .type_name("[all][,-NAME]");

    Command layers = command.add_group("Light layers");
    layers
        .add_option("--bounces", a.bounces,
                    "bounces b0…bK stored one by one, everything past them goes to `tail`; auto: "
                    "up to the last of b0…b6 with 1 % of the light, or with S of auto=S")
        .type_name("K|auto[=S]");
    layers.add_option("--lights", a.lights, "rows of the light mixer")
        .one_of({"per-light", "groups", "off"});
    layers.add_option("--layers", a.layers,
                      "families to store, of bounce,light,matrix,shadow,caster,lobe,data; or none");
    layers
        .add_option("--casters", a.casters,
                    "with --layers …,caster: prims whose shadows get layers, as a path expression "
                    "such as /World/Trees/* or //Vase; all else is `rest`; may be repeated "
                    "(default: by the names, models and prims of the scene)")
        .type_name("PATTERN")
        .expected(1)
        .take_all();
    layers
        .add_option(
            "--lpe", a.lpe,
            "one more layer, of the light whose paths match: C<RD>L, C.{2}<L.'key'>, "
            "unoccluded;C.L … (docs/reference/light_path_expressions.md); may be given again")
        .type_name("NAME=EXPRESSION")
        .expected(1)
        .take_all();
    layers.add_flag(
        "--lpe-strict", a.strict_lpe,
        "in light path expressions G is rough and S a mirror; else each is any specular");
    layers.add_flag("--halves", a.halves, "store two independent half images of every layer");
    constexpr double min_clamp = 1e-30, max_clamp = 1e30;
    layers
        .add_option("--clamp-direct", a.clamp_direct,
                    "largest channel of what one contribution may bring at b0 and b1; the rest "
                    "goes to clamp_ layers")
        .range(min_clamp, max_clamp);
    layers.add_option("--clamp-indirect", a.clamp_indirect, "the same at b2 and up")
        .range(min_clamp, max_clamp);
    layers.add_flag("--float-layers", a.float_layers,
                    "store light layers as float instead of half");
    layers.add_option(
        "--cryptomatte", a.cryptomatte,
        "mattes by name, as Cryptomatte: object (prim path), material, or object,material");
    layers
        .add_option("--cryptomatte-levels", a.matte_levels,
                    "objects, or materials, that a pixel has room for: those that cover most")
        .range(1, 64);
    layers.add_flag("--deep", a.deep,
                    "write FILE.deep.exr beside the picture: what each pixel shows by depth");
    layers
        .add_option("--deep-samples", a.deep_samples,
                    "depths that a pixel of it has room for; beyond that the nearest to each "
                    "other become one")
        .range(1, 1024);
    layers
        .add_option("--exr-layout", a.exr_layout,
                    "multipart (one part per family), single part, or split files")
        .one_of({"multipart", "single", "split"});

    layers
        .add_option("--exr-compression", a.exr_compression,
                    "how files are packed, without loss: none, rle, zips, zip (16 rows at a time) "
                    "or piz (wavelets)")
        .one_of(compression_names());

    Command report = command.add_group("Reports");
    report
        .add_option("--checkpoint", a.checkpoint,
                    "progressive: keep the sums and write the file this often, e.g. 5m, for "
                    "--resume after whatever may happen")
        .not_empty();
    report
        .add_option("--snapshot", a.snapshot,
                    "progressive: write an interim image this often, e.g. 10s; it keeps the sums, "
                    "so that --resume can go on from it; the finished file needs --keep-sums for "
                    "that")
        .not_empty();
    report
        .add_option("--progress", a.progress,
                    "bar (lines when not on a terminal), json, openjd or none")
        .one_of({"bar", "json", "openjd", "none"});
    report.add_option("--stats", a.stats, "write statistics as JSON, of each frame as -o").writes();
    report.add_flag("--strict", a.strict,
                    "an error in the scene or a bad sample stops the render with an exit code");
    report
        .add_option("--texture-failure", a.texture_failure,
                    "a picture that cannot be read: colour (its fallback is used, and counted) or "
                    "error (no render, or exit code 1 where it is found later)")
        .one_of({"colour", "error"});
    report.add_option("--replay", a.replay, "trace one sample of one pixel and print its path")
        .type_name("x,y,s")
        .not_empty();
    report.add_flag("-q,--quiet", a.quiet, "print errors only");
    report.add_flag("-v,--verbose", a.verbosity, "print more");
}

}  // namespace velatura::app
