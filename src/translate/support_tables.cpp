// SPDX-License-Identifier: Apache-2.0
#include "translate/schema_support.h"

namespace velatura::translate {

namespace {

using enum Support;

constexpr UnusedAttribute unused[] = {
    {"Boundable", "extent", NoEffect},
    {"Sphere", "extent", NoEffect},
    {"Cube", "extent", NoEffect},
    {"Cylinder", "extent", NoEffect},
    {"Cylinder_1", "extent", NoEffect},
    {"Cone", "extent", NoEffect},
    {"Capsule", "extent", NoEffect},
    {"Capsule_1", "extent", NoEffect},
    {"Plane", "extent", NoEffect},
    {"Cylinder_1", "radiusTop", Warned},
    {"Capsule_1", "radiusTop", Warned},
    {"TetMesh", "tetVertexIndices", NoEffect},
    {"TetMesh", "surfaceFaceVertexIndices", NoEffect},
    {"NurbsCurves", "order", NoEffect},
    {"NurbsCurves", "knots", NoEffect},
    {"NurbsCurves", "ranges", NoEffect},
    {"NurbsCurves", "pointWeights", NoEffect},
    {"HermiteCurves", "tangents", NoEffect},
    {"NurbsPatch", "uForm", NoEffect},
    {"NurbsPatch", "vForm", NoEffect},
    {"NurbsPatch", "uVertexCount", NoEffect},
    {"NurbsPatch", "vVertexCount", NoEffect},
    {"NurbsPatch", "uOrder", NoEffect},
    {"NurbsPatch", "vOrder", NoEffect},
    {"NurbsPatch", "uKnots", NoEffect},
    {"NurbsPatch", "vKnots", NoEffect},
    {"NurbsPatch", "uRange", NoEffect},
    {"NurbsPatch", "vRange", NoEffect},
    {"NurbsPatch", "pointWeights", NoEffect},
    {"NurbsPatch", "trimCurve:counts", NoEffect},
    {"NurbsPatch", "trimCurve:orders", NoEffect},
    {"NurbsPatch", "trimCurve:vertexCounts", NoEffect},
    {"NurbsPatch", "trimCurve:knots", NoEffect},
    {"NurbsPatch", "trimCurve:ranges", NoEffect},
    {"NurbsPatch", "trimCurve:points", NoEffect},
    {"Camera", "clippingPlanes", Warned},
    {"Camera", "stereoRole", NoEffect},
    {"MotionAPI", "motion:nonlinearSampleCount", NoEffect},
    {"GeomModelAPI", "model:drawMode", Warned, "the geometry itself is rendered"},
    {"GeomModelAPI", "model:applyDrawMode", NoEffect},
    {"GeomModelAPI", "model:drawModeColor", NoEffect},
    {"GeomModelAPI", "model:cardGeometry", NoEffect},
    {"GeomModelAPI", "model:cardTextureXPos", NoEffect},
    {"GeomModelAPI", "model:cardTextureYPos", NoEffect},
    {"GeomModelAPI", "model:cardTextureZPos", NoEffect},
    {"GeomModelAPI", "model:cardTextureXNeg", NoEffect},
    {"GeomModelAPI", "model:cardTextureYNeg", NoEffect},
    {"GeomModelAPI", "model:cardTextureZNeg", NoEffect},
    {"GenerativeProcedural", "proceduralSystem", Warned,
     "procedurals are not supported; its geometry is not rendered"},
    {"LightAPI", "light:shaderId", NoEffect},
    {"MeshLightAPI", "light:shaderId", NoEffect},
    {"VolumeLightAPI", "light:shaderId", NoEffect},
    {"VolumeLightAPI", "light:materialSyncMode", NoEffect},
    {"DistantLight", "light:shaderId", NoEffect},
    {"DomeLight", "light:shaderId", NoEffect},
    {"DomeLight", "guideRadius", NoEffect},
    {"DomeLight_1", "light:shaderId", NoEffect},
    {"DomeLight_1", "guideRadius", NoEffect},
    {"GeometryLight", "light:shaderId", NoEffect},
    {"RectLight", "light:shaderId", NoEffect},
    {"DiskLight", "light:shaderId", NoEffect},
    {"SphereLight", "light:shaderId", NoEffect},
    {"CylinderLight", "light:shaderId", NoEffect},
    {"PortalLight", "light:shaderId", NoEffect},
    {"Shader", "info:implementationSource", Warned,
     "shaders by file or source code are not supported; only info:id selects one"},
    {"UsdPreviewSurface", "inputs:occlusion", Warned},
    {"RenderProduct", "productType", Warned},
    {"RenderPass", "denoise:enable", Warned, "the image is not denoised; `velatura-comp denoise`"},
    {"RenderPass", "passType", NoEffect},
    {"RenderPass", "command", NoEffect},
    {"RenderPass", "fileName", Warned, "the render settings are those of the stage"},
    {"FieldAsset", "filePath", NoEffect},
    {"FieldAsset", "fieldName", NoEffect},
    {"FieldAsset", "fieldIndex", NoEffect},
    {"FieldAsset", "fieldDataType", NoEffect},
    {"FieldAsset", "vectorDataRoleHint", NoEffect},
    {"OpenVDBAsset", "fieldDataType", NoEffect},
    {"OpenVDBAsset", "vectorDataRoleHint", NoEffect},
    {"Field3DAsset", "fieldPurpose", NoEffect},
    {"VolumeFieldAsset", "filePath", NoEffect},
    {"VolumeFieldAsset", "fieldName", NoEffect},
    {"VolumeFieldAsset", "fieldIndex", NoEffect},
    {"VolumeFieldAsset", "fieldDataType", NoEffect},
    {"VolumeFieldAsset", "vectorDataRoleHint", NoEffect},
    {"ParticleFieldPositionAttributeAPI", "positions", NoEffect},
    {"ParticleFieldPositionAttributeAPI", "positionsh", NoEffect},
    {"ParticleFieldOrientationAttributeAPI", "orientations", NoEffect},
    {"ParticleFieldOrientationAttributeAPI", "orientationsh", NoEffect},
    {"ParticleFieldScaleAttributeAPI", "scales", NoEffect},
    {"ParticleFieldScaleAttributeAPI", "scalesh", NoEffect},
    {"ParticleFieldOpacityAttributeAPI", "opacities", NoEffect},
    {"ParticleFieldOpacityAttributeAPI", "opacitiesh", NoEffect},
    {"ParticleFieldSphericalHarmonicsAttributeAPI", "radiance:sphericalHarmonicsCoefficients",
     NoEffect},
    {"ParticleFieldSphericalHarmonicsAttributeAPI", "radiance:sphericalHarmonicsCoefficientsh",
     NoEffect},
    {"ParticleFieldSphericalHarmonicsAttributeAPI", "radiance:sphericalHarmonicsDegree", NoEffect},
    {"ParticleField3DGaussianSplat", "projectionModeHint", NoEffect},
    {"ParticleField3DGaussianSplat", "sortingModeHint", NoEffect},
    {"UsdPrimvarReader_string", "inputs:varname", NoEffect},
    {"UsdPrimvarReader_string", "inputs:fallback", NoEffect},
    {"Skeleton", "jointNames", NoEffect},
    {"SpatialAudio", "filePath", NoEffect},
    {"SpatialAudio", "auralMode", NoEffect},
    {"SpatialAudio", "playbackMode", NoEffect},
    {"SpatialAudio", "startTime", NoEffect},
    {"SpatialAudio", "endTime", NoEffect},
    {"SpatialAudio", "mediaOffset", NoEffect},
    {"SpatialAudio", "gain", NoEffect},
};

constexpr TokenChoice choices[] = {
    {"visibility", "inherited|invisible", "the prim stays visible"},
    {"purpose", "default|render|proxy|guide", "the prim is not rendered"},
    {"axis", "X|Y|Z", "Z is used"},
    {"orientation", "rightHanded|leftHanded", "rightHanded is used"},
    {"elementType", "face", "the subset is ignored"},
    {"projection", "perspective|orthographic", "perspective is used"},
    {"units", "sceneTenths|millimeters", "sceneTenths is used"},
    {"poleAxis", "scene|Y|Z", "Y is used"},
    {"sourceType", "raw|primvar|lpe|intrinsic", "raw is used"},
    {"inputs:opacityMode", "transparent|presence", "transparent is used"},
    {"guideVisibility", "inherited|invisible|visible", "visible is used"},
    {"proxyVisibility", "inherited|invisible|visible", "visible is used"},
    {"renderVisibility", "inherited|invisible|visible", "visible is used"},
};

constexpr ExtraName names_beside_schemas[] = {
    {"", "velatura:shadow:caster"},
    {"", "primvars:velatura:matte"},
    {"", "primvars:velatura:catcher"},
    {"", "primvars:crypto_asset"},
    {"", "primvars:velatura:visibility:camera"},
    {"", "primvars:velatura:visibility:shadow"},
    {"", "primvars:velatura:visibility:diffuse"},
    {"", "primvars:velatura:visibility:diffuseTransmission"},
    {"", "primvars:velatura:visibility:reflection"},
    {"", "primvars:velatura:visibility:refraction"},
    {"", "primvars:velatura:visibility:volume"},
    {"", "primvars:velatura:visibility:indirect"},
    {"", "material:binding"},
    {"", "material:binding:full"},
    {"", "material:binding:preview"},
    {"", "material:binding:collection"},
    {"LightAPI", "velatura:light:group"},
    {"LightAPI", "filters"},
    {"Camera", "velatura:lens:blades"},
    {"Camera", "velatura:lens:rotation"},
    {"Camera", "velatura:lens:roundness"},
    {"Camera", "velatura:shutter:curve"},
    {"PointBased", "primvars:normals"},
    {"Curves", "primvars:widths"},
    {"Curves", "primvars:screenSpaceWidths"},
    {"Points", "primvars:widths"},
    {"Points", "primvars:screenSpaceWidths"},
    {"Material", "outputs:surface"},
    {"Material", "outputs:displacement"},
    {"Material", "outputs:volume"},
    {"Material", "outputs:mtlx:surface"},
    {"Material", "outputs:mtlx:displacement"},
    {"Material", "outputs:mtlx:volume"},
    {"Material", "outputs:velatura:surface"},
    {"Material", "outputs:velatura:volume"},
    {"RenderVar", "driver:parameters:aov:name"},
    {"RenderVar", "driver:parameters:aov:channel_prefix"},
    {"RenderVar", "velatura:filter"},
    {"RenderVar", "driver:parameters:aov:filter"},
    {"RenderVar", "driver:parameters:aov:rule"},
    {"RenderVar", "ri:accumulationRule"},
    {"RenderVar", "ri:displayChannel:filter"},
    {"RenderVar", "arnold:filter"},
    {"LightListAPI", "lightList"},
    {"LightListAPI", "lightList:cacheBehavior"},
};

constexpr std::string_view without_image[] = {
    "Physics*",
    "Physx*",
    "Semantics*",
    "Accessibility*",
    "Houdini*",
    "Omni*",
    "Preliminary_*",
    "AssetPreviewsAPI",
    "LightListAPI",
    "ListAPI",
    "NodeDefAPI",
    "ConnectableAPI",
    "CoordSysAPI",
    "ModelAPI",
    "ClipsAPI",
    "NodeGraphNodeAPI",
    "ColorSpaceAPI",
    "SceneGraphPrimAPI",
    "AttributeLimitsAPI",
    "ColorSpaceDefinitionAPI",
    "HydraGenerativeProceduralAPI",
    "MaterialXConfigAPI",
    "ParticleFieldKernel*",
    "ParticleFieldPositionBaseAPI",
    "ParticleFieldRadianceBaseAPI",
    "MayaReference",
    "ALMayaReference",
};

constexpr ForeignRenderer renderers[] = {
    {"Arnold", "primvars:arnold:|arnold:|inputs:arnold:"},
    {"Karma", "primvars:karma:|karma:|inputs:karma:"},
    {"RenderMan", "primvars:ri:|ri:|inputs:ri:|primvars:rman:|rman:|riattributes:|outputs:ri:"},
    {"V-Ray", "primvars:vray:|vray:|inputs:vray:"},
    {"Cycles", "primvars:cycles:|cycles:|inputs:cycles:|primvars:blender:cycles:"},
    {"Redshift", "primvars:redshift:|redshift:|inputs:redshift:"},
    {"MoonRay", "primvars:moonray:|moonray:|inputs:moonray:"},
    {"3Delight", "primvars:nsi:|nsi:|inputs:nsi:|primvars:dl:"},
    {"Octane", "primvars:octane:|octane:|inputs:octane:"},
    {"OSPRay", "primvars:ospray:|ospray:|inputs:ospray:"},
    {"RTX", "omni:rtx:|primvars:omni:rtx:|inputs:omni:rtx:"},
};

constexpr std::string_view seen_by_all =
    "the prim is seen by all rays and casts shadows; primvars:velatura:visibility decides";

constexpr ForeignRequest requests[] = {
    {"lpetag|arnold:aov", "", ""},
    {"primvars:arnold:visibility:camera|primvars:arnold:visibility:shadow|"
     "primvars:arnold:visibility:diffuse_reflect|primvars:arnold:visibility:diffuse_transmit|"
     "primvars:arnold:visibility:specular_reflect|primvars:arnold:visibility:specular_transmit|"
     "primvars:arnold:visibility:volume|primvars:arnold:matte|"
     "primvars:karma:object:rendervisibility|primvars:karma:object:holdoutmode|"
     "karma:light:renderlightgeo|primvars:ri:attributes:visibility:camera|"
     "primvars:ri:attributes:visibility:indirect|primvars:ri:attributes:visibility:transmission|"
     "primvars:ri:attributes:ri:matte|primvars:ri:attributes:trace:holdout|"
     "primvars:cycles:object:is_shadow_catcher",
     "", ""},
    {"primvars:arnold:visibility:", "1|true", seen_by_all},
    {"primvars:arnold:visibility", "", ""},
    {"matte|holdout|shadow_catcher|shadowcatcher|is_shadow_catcher", "0|false|off|none",
     "the prim is rendered as any other, with its own alpha; primvars:velatura:matte holds out, "
     "primvars:velatura:catcher catches shadows"},
    {"visib|renderlightgeo|shadowcaster|cast_shadow|castshadow|receive_shadow|receiveshadow|"
     "self_shadow|primaryray|primary_ray|hide_|hidden_|invisible",
     "1|255|-1|true|on|*|visible|all", seen_by_all},
    {"opaque", "1|true", "the opacity of the material decides, in shadows too"},
    {"subdiv|tess|dicing|dice|micropolygon|catclark", "none|0|false|off",
     "subdivisionScheme and --dicing-rate decide"},
    {"displac|disp_|dispmap|autobump|auto_bump|zero_value", "0|false|none",
     "the displacement of the material decides, unscaled"},
    {"sidedness|sides|singlesided|single_sided|doublesided|double_sided|invert_normal", "2|255",
     "doubleSided and orientation decide"},
    {"light_group|lightgroup|lightcategor|trace_set|traceset|subset|excludesubset|shadow_group|"
     "contrib|membership",
     "*|0|false|none", "the collections lightLink and shadowLink of UsdLux decide"},
    {"blur|motion|shutter|xform_keys|transform_keys|deform_keys", "1|true",
     "shutter:open and shutter:close of the camera decide"},
    {"clamp|colorlimit", "0|false", "--clamp-direct and --clamp-indirect decide"},
    {"limit|depth|bounce", "", "--max-depth decides"},
    {"samples|aa_|spp|pixelvariance|convergence|threshold|variance", "",
     "--spp, --adaptive and --target-error decide"},
    {"step_size|stepsize|stepscale|step_scale|volume_padding", "0", "volumes are free of steps"},
    {"pixelfilter|filterwidth|filter_width|filtersize", "", "--filter decides"},
    {"lensshader|lens_shader|projection|bokeh|aperture_blades", "0|none",
     "the camera is one of UsdGeomCamera with velatura:lens:blades"},
    {"spread|roundness|soft_edge|lens_radius|portal_mode|emissionfocus|shadowcolor|shadowdistance|"
     "falloff|decay",
     "0|1|none", "the light is one of UsdLux, with ShapingAPI and ShadowAPI"},
    {"min_pixel_width|minpixelwidth|curve_mode|arnold:mode|basis", "0|ribbon",
     "curves are those of UsdGeom"},
    {"mediapriority|dielectricpriority|dielectric_priority", "0",
     "inputs:velatura:dielectricPriority decides"},
    {"caustic", "0|1|true", "--caustics decides"},
};

}  // namespace

std::span<const UnusedAttribute> unused_attributes() {
    return unused;
}

Support support_of(std::string_view schema, std::string_view attribute) {
    for (const UnusedAttribute& row : unused)
        if (row.schema == schema && row.attribute == attribute) return row.support;
    return Used;
}

std::span<const TokenChoice> token_choices() {
    return choices;
}

std::span<const ExtraName> other_names() {
    return names_beside_schemas;
}

std::span<const std::string_view> schemas_without_image() {
    return without_image;
}

std::span<const ForeignRenderer> foreign_renderers() {
    return renderers;
}

std::span<const ForeignRequest> foreign_requests() {
    return requests;
}

}  // namespace velatura::translate
