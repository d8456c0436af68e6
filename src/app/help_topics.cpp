// SPDX-License-Identifier: Apache-2.0
#include "app/help_topics.h"

namespace velatura::app {

namespace {

constexpr HelpTopic topics[] = {
    {"layers", "Light layers: bounces, light groups, shadows, AOVs, mixing", R"(Light layers

A render is stored as additive layers. They sum to the beauty, bit for bit.

  b0               emission or background seen directly
  b1 ... bK        direct light (b1), then indirect light bounce by bounce (--bounces K)
  tail             all later bounces
  C_GROUP          all light of one light group (--lights)
  b1_GROUP ...     one bounce of one light group: the matrix
  U_GROUP          direct light of the group without occluders
  S_GROUP          its shadow: U_GROUP minus b1_GROUP
  albedo N P Z ... data of the first surface

--layers chooses the sets: bounce, light, matrix, shadow, data are the default; caster adds
shadows per shadow caster, lobe adds diffuse, specular, transmission and others; lobe-matrix
stores b1_GROUP_specular and so on: light, bounce and lobe, each with a fader in the mixer;
none stores the beauty alone.

  velatura render shot.usda -o shot.exr --bounces 2 --lights per-light
  velatura render shot.usda -o shot.exr --layers bounce,light --float-layers
  velatura render shot.usda -o shot.exr --layers bounce,light,matrix,shadow,caster,data

Data layers by name: any primvar, Neye, Peye, Ng, elementId, motion vectors (motion, backward),
each with a filter (average, closest, min, max):

  velatura render shot.usda -o shot.exr --layers bounce,data,primvar:Pref,Z:min,motion

Light path expressions add AOVs of their own. Cryptomattes and deep images are separate:

  velatura render shot.usda -o shot.exr --lpe "key_gi=C.{2,}<L.'key'>"
  velatura render shot.usda -o shot.exr --cryptomatte object,material --deep

List and verify the layers of a file, then mix them:

  velatura-comp info shot.exr
  velatura-comp verify shot.exr
  velatura-comp mix shot.exr -o shot.png --gain key=+1.5st --gain indirect=2 --shadow key=0.3

Noise prediction (velatura-comp noise) and denoising (velatura-comp denoise) need half images:
render with --halves.

Reference: docs/reference/layers.md, docs/reference/mix.md,
docs/reference/light_path_expressions.md
)"},
    {"farm", "Sequences, sample ranges, merge, checkpoints, resume", R"(Sequences and farm

Sequence: #### in the name of the output is the frame number. %04d, $F4 and <F4> work too.

  velatura render shot.usda -o 'shot.####.exr' --frames 1-100

One frame on several machines: render a sample range on each, then merge. The result is the
render of all samples on one machine, bit for bit.

  velatura render shot.usda -o a.exr --samples 0:128
  velatura render shot.usda -o b.exr --samples 128:256 --rates-from a.exr
  velatura-comp merge a.exr b.exr -o shot.exr --expect 0:256

--rates-from saves later parts the pilot samples of adaptive sampling. merge refuses other scenes,
other settings, incomplete parts, overlaps and gaps (exit code 5), and names each fault.

farm submit does this for you: it splits a render into pieces, renders them, renders those that
failed again, and merges them.

  velatura farm submit shot.usda -o shot.exr --spp 256 --pieces 8 --job shot.farm
  velatura farm status shot.farm
  velatura farm retry shot.farm

Stop and resume: --checkpoint writes a resumable file at an interval. --resume adds the samples
that are missing, and starts from the first sample if there is no file. A farm can repeat the
same command until it succeeds.

  velatura render shot.usda -o shot.exr --spp 256 --checkpoint 5m --resume

--resumable makes a finished render resumable. --resume refuses a file of another scene or of
other settings (exit code 5).

Progress for a scheduler: --progress json, or --progress openjd for Open Job Description, which
ends with openjd_fail and the reason of a failure.

Signals: USR1 writes an interim image. INT and TERM write what is finished, which --resume can
continue, and stop with exit code 128+n; a second signal, half a second later or more, stops at
once, without a file.

Exit codes: `velatura --help` lists them. 3 means that the file is valid but incomplete.

Reference: docs/guide/sequences_and_farm.md, docs/reference/farm.md,
docs/reference/resume_and_merge.md, docs/reference/recovery.md, docs/reference/command_line.md
)"},
    {"memory", "Memory limits and what happens when they are reached", R"(Memory

--memory-limit limits the resident memory of render, plan, study, info, flatten and import.
A size is a number with K, M, G, T, KiB, MiB, GiB or TiB, or a percentage of the machine's.

  velatura render shot.usda -o shot.exr --memory-limit 8G
  velatura plan shot.usda --memory-limit 50%

velatura plan predicts the memory of film, BVH and writing.

If the limit is reached
  while the scene is read   exit code 6; no file is written
  before the first sample   exit code 6 if even layers with light in few places do not fit
  during the render         textures are freed. If that is not enough, the render stops, writes
                            what it has, and ends with exit code 3; --resume with a higher limit
                            continues a resumable file
  while a file is written   it is written by one thread, then without textures; then exit code 6,
                            and the previous file stays

To use less memory
  --layers, --bounces, --lights    fewer layers
  --crop                           a part of the image
  --dicing-rate, --dicing-limit    fewer triangles of subdivision surfaces
  --volume-memory, --instance-limit limits of volume grids and instances

Layers of 96 samples per pixel need twice the memory of 64 or 128: sums take one part per power
of two of the number of samples.

Reference: docs/reference/memory.md
)"},
    {"security", "Untrusted scenes: files, limits, sandbox", R"(Untrusted scenes

A scene is data: there are no scripts, no plugins from asset paths, and no shell.

  velatura render scene.usdz -o scene.exr --confine --memory-limit 8G

Files. URLs, network shares, pipes and devices are always refused. So are names that leave their
package. Other paths are followed as in OpenUSD, unless
  --confine          files are read only below the scene's own folder, after links are followed
  --asset-root DIR   the same, and also below DIR; $VELATURA_ASSET_ROOTS adds more, separated
                     by ':', and confines by itself
A refused file is an error at the place that names it. The rest is rendered; with --strict
nothing is.

Limits of what files can request: --limit NAME=VALUE, repeatable. The defaults are
  prims=2e7              prims of the composed stage
  prims-per-spec=1000    composed prims per authored one, on average
  layers=1e5             layers of one stage
  array-bytes=1GiB       compressed arrays of .usdc files
  image-side=1048576     width and height of a texture
  decode-time=60s        CPU time of one request to an image decoder
  decode-memory=8GiB     memory of an image decoder
--instance-limit and --volume-memory limit instances and volume grids.

With --sandbox, --confine or --asset-root images are decoded in separate processes. On x86-64
and ARM these cannot write files, open sockets or start programs; a crash, a hang or exhausted
memory costs the one image. Without these options images are decoded in the renderer.

With --confine or --asset-root a scene does not choose the output folder: only the last part of
its productName is used.

Reference: docs/reference/security.md, docs/reference/missing_assets.md
)"},
};

}  // namespace

std::span<const HelpTopic> help_topics() {
    return topics;
}

}  // namespace velatura::app
