// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/world.h"
#include "plugins/hydra/render_buffer.h"
#include "plugins/hydra/scene_records.h"

#include <pxr/base/gf/matrix4d.h>
#include <pxr/imaging/hd/aov.h>

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::hydra {

/// One AOV that a host binds.
struct AovRequest {
    enum class Kind : uint8_t {
        Color,        ///< beauty and alpha, premultiplied
        Depth,        ///< of clip space, [0, 1], of what is nearest at the center of the pixel
        CameraDepth,  ///< of the same, along the view [scene units]
        PrimId,
        InstanceId,
        ElementId,
        Normal,     ///< mean shading normal of world space
        EyeNormal,  ///< the same of camera space
        Layer,      ///< a layer of the file, by name
        Unknown,
    };

    Kind kind = Kind::Unknown;
    std::string name;   ///< as bound
    std::string layer;  ///< Kind::Layer
    RenderBuffer* buffer = nullptr;
};

/// What the bindings ask for: `sourceName` of their settings (a RenderVar's), else their names.
/// Adds the families of layers and the light path expressions that they need to `layers`.
/// Expressions that are wrong are reported, and have Kind::Unknown.
std::vector<AovRequest> read_bindings(const PXR_NS::HdRenderPassAovBindingVector& bindings,
                                      film::LayerSet& layers);

/// What is nearest at the centers of pixels.
struct NearestHits {
    std::vector<int32_t> prims, instances, elements;  ///< [y][x] from the top; −1: nothing
    std::vector<float> depths;  ///< along the view [scene units]; infinite: nothing
};

/// Args: window: pixels of the image to look at.
NearestHits find_nearest(const integrator::World& world,
                         const film::Window& window,
                         const LayerPlaces& places);

/// How the film lies in the buffers.
struct BufferFrame {
    int left = 0, top = 0;  ///< of the film's window in the buffer, from its upper left corner
    PXR_NS::GfMatrix4d projection = PXR_NS::GfMatrix4d(1.0);  ///< camera space to clip space
    PXR_NS::GfMatrix4d eye_from_world = PXR_NS::GfMatrix4d(1.0);
};

/// Writes the film into the buffers. Layers without any light are black. Names that are no layer
/// are reported once each.
void write_aovs(const std::vector<AovRequest>& requests,
                const film::Film& film,
                const NearestHits& nearest,
                const BufferFrame& frame);

/// The format that a host allocates by default; HdFormatInvalid: unknown.
PXR_NS::HdAovDescriptor default_descriptor(const PXR_NS::TfToken& name);

}  // namespace velatura::hydra
