// SPDX-License-Identifier: Apache-2.0
#include "import/context.h"

#include <assimp/camera.h>
#include <assimp/light.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::import {

namespace {

namespace layer = usd::layer;

Vec3d to_vector(const aiVector3D& v) {
    return {double(v.x), double(v.y), double(v.z)};
}

/// The frame that looks along `direction` with −Z and has `up` upwards; USD's lights and cameras
/// look along −Z.
Mat4d looking_along(const Vec3d& position, const Vec3d& direction, const Vec3d& up) {
    const double length = direction.length();
    // Point lights have none
    if (!(length > 0.0)) return Mat4d().setTranslation(position);
    const Vec3d z = -direction / length;
    Vec3d x = (up.length() > 0.0 ? up : Vec3d(0, 1, 0)).cross(z);
    if (!(x.length() > 1e-9))
        x = std::abs(z.x) < 0.9 ? Vec3d(1, 0, 0).cross(z) : Vec3d(0, 1, 0).cross(z);
    x = x / x.length();
    const Vec3d y = z.cross(x);
    return Mat4d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, position.x, position.y,
                 position.z, 1);
}

void author_transform(Context& ctx, Path prim, const Mat4d& matrix) {
    if (matrix == Mat4d()) return;
    ctx.author.attribute(prim, "xformOp:transform", "matrix4d", Value(layer::Mat4d(matrix)));
    ctx.author.uniform(prim, "xformOpOrder", "token[]",
                       Value::array(std::vector<layer::Token>{layer::Token("xformOp:transform")}));
}

void author_color(Context& ctx, Path prim, const Vec3d& color) {
    // The brightest channel is the intensity, so that color stays a color
    const double intensity = std::max({color.x, color.y, color.z});
    const Vec3d unit = intensity > 0.0 ? color / intensity : Vec3d(1.0);
    ctx.author.attribute(prim, "inputs:color", "color3f",
                         Value(layer::Vec3f(float(unit.x), float(unit.y), float(unit.z))));
    ctx.author.attribute(prim, "inputs:intensity", "float", Value(float(intensity)));
}

/// Factor from a light's color to the radiant intensity of a point light in world units that falls
/// off with the square of the distance. glTF speaks of candela. Other files give the irradiance
/// (as Phong's model means it: a white diffuse surface then shows this color, hence π) by a
/// polynomial of the distance in the light's own units; it is met at the middle of the scene.
double point_intensity(Context& ctx, Path prim, const aiLight& light, const Mat4d& world) {
    if (ctx.format == Format::Gltf) return 1.0;
    const double scale = std::cbrt(std::abs(determinant3(world)));
    const Vec3d position = transform_point(to_vector(light.mPosition), world);
    double distance = (ctx.center - position).length();
    if (!(distance > 0.0)) distance = 1.0;
    const double d = scale > 0.0 ? distance / scale : distance;
    const double linear = double(light.mAttenuationLinear);
    const double quadratic = double(light.mAttenuationQuadratic);
    // Lights of .fbx files that do not decay have the distance there from which on they would
    const bool is_distance = ctx.format == Format::Fbx && linear == 0.0 && quadratic == 0.0;
    const double constant = is_distance ? 1.0 : double(light.mAttenuationConstant);
    const double falloff = constant + linear * d + quadratic * d * d;
    if (constant != 0.0 || linear != 0.0)
        ctx.warn("import-falloff",
                 fmt::format("light falls off by 1 / ({} + {} d + {} d²); it is imported with 1 / "
                             "d², equal at the middle of the scene",
                             constant, linear, quadratic),
                 prim.to_string());
    return falloff > 0.0 && std::isfinite(falloff) ? pi_d * distance * distance / falloff : pi_d;
}

/// Point and spot lights: a small sphere. A sphere of radiance L and radius r has the intensity
/// L π r²; with `normalize`, L = I' / (4 π r²): I' is four times the intensity.
void author_sphere(Context& ctx, Path prim, const aiLight& light, const Mat4d& world) {
    const double scale = std::cbrt(std::abs(determinant3(world)));
    const Vec3d position = transform_point(to_vector(light.mPosition), world);
    const double distance = (ctx.center - position).length();
    const double radius = 1e-3 * (distance > 0.0 ? distance : 1.0);
    ctx.author.attribute(prim, "inputs:radius", "float",
                         Value(float(scale > 0.0 ? radius / scale : radius)));
    ctx.author.attribute(prim, "treatAsPoint", "bool", Value(true));
    ctx.author.attribute(prim, "inputs:normalize", "bool", Value(true));
    const aiColor3D& c = light.mColorDiffuse;
    author_color(ctx, prim,
                 Vec3d(double(c.r), double(c.g), double(c.b)) *
                     (4.0 * point_intensity(ctx, prim, light, world)));
    if (light.mType != aiLightSource_SPOT) return;
    // Half angles in glTF, whole ones elsewhere
    const double part = ctx.format == Format::Gltf ? 1.0 : 0.5;
    const double outer = double(light.mAngleOuterCone) * part;
    const double inner = std::clamp(double(light.mAngleInnerCone) * part, 0.0, outer);
    ctx.author.apply_schema(prim, "ShapingAPI");
    ctx.author.attribute(prim, "inputs:shaping:cone:angle", "float",
                         Value(float(std::clamp(outer * 180 / pi_d, 0.0, 180.0))));
    ctx.author.attribute(prim, "inputs:shaping:cone:softness", "float",
                         Value(float(outer > 0.0 ? 1.0 - inner / outer : 0.0)));
}

const char* light_type(const aiLight& light) {
    switch (light.mType) {
        case aiLightSource_DIRECTIONAL:
            return "DistantLight";
        case aiLightSource_POINT:
        case aiLightSource_SPOT:
            return "SphereLight";
        case aiLightSource_AREA:
            return "RectLight";
        case aiLightSource_AMBIENT:
            return "DomeLight";
        default:
            return nullptr;
    }
}

/// Assimp's angle for cameras of .fbx files that have none.
bool is_made_up_angle(const Context& ctx, const aiCamera& camera) {
    return ctx.format == Format::Fbx && std::abs(double(camera.mHorizontalFOV) - pi_d / 180) < 1e-8;
}

/// Vertical field of view in radians and aspect ratio (0 = unknown).
std::pair<double, double> field_of_view(const Context& ctx, const aiCamera& camera) {
    const double aspect = double(camera.mAspect);
    const double fov = double(camera.mHorizontalFOV);
    // Assimp's "horizontal" angle of glTF cameras is the vertical one times the aspect ratio
    if (ctx.format == Format::Gltf) return {aspect > 0.0 ? fov / aspect : fov, aspect};
    return {2 * std::atan(std::tan(fov / 2) / (aspect > 0.0 ? aspect : 4.0 / 3.0)), aspect};
}

}  // namespace

Mat4d to_matrix(const aiMatrix4x4& m) {
    Mat4d out;
    for (unsigned r = 0; r < 4; ++r)
        for (unsigned c = 0; c < 4; ++c) out[int(c)][int(r)] = double(m[r][c]);
    return out;
}

void author_light(Context& ctx, Path parent, const aiLight& light, const Mat4d& world) {
    const char* type = light_type(light);
    if (type == nullptr) {
        ctx.warn("import-light",
                 fmt::format("light \"{}\" has a type unknown to Assimp; it is skipped",
                             light.mName.C_Str()),
                 parent.to_string());
        return;
    }
    const Path prim = ctx.author.define(parent, "Light", type);
    ++ctx.summary.lights;
    const aiColor3D& c = light.mColorDiffuse;
    const Vec3d color(double(c.r), double(c.g), double(c.b));
    if (light.mType != aiLightSource_AMBIENT)
        author_transform(ctx, prim,
                         looking_along(to_vector(light.mPosition), to_vector(light.mDirection),
                                       to_vector(light.mUp)));
    switch (light.mType) {
        case aiLightSource_DIRECTIONAL:
            // Normalized, the intensity is the irradiance: lux in glTF
            ctx.author.attribute(prim, "inputs:normalize", "bool", Value(true));
            author_color(ctx, prim, color * (ctx.format == Format::Gltf ? 1.0 : pi_d));
            break;
        case aiLightSource_AREA:
            ctx.author.attribute(prim, "inputs:width", "float", Value(float(light.mSize.x)));
            ctx.author.attribute(prim, "inputs:height", "float", Value(float(light.mSize.y)));
            author_color(ctx, prim, color);
            break;
        case aiLightSource_AMBIENT: {
            const aiColor3D& a = light.mColorAmbient;
            author_color(ctx, prim, Vec3d(double(a.r), double(a.g), double(a.b)));
            break;
        }
        default:
            author_sphere(ctx, prim, light, world);
    }
}

void author_camera(Context& ctx, Path parent, const aiCamera& camera) {
    const Path prim = ctx.author.define(parent, "Camera", "Camera");
    ++ctx.summary.cameras;
    // Assimp repeats the node's translation in the position of glTF cameras
    const Vec3d position = ctx.format == Format::Gltf ? Vec3d(0.0) : to_vector(camera.mPosition);
    author_transform(ctx, prim,
                     looking_along(position, to_vector(camera.mLookAt), to_vector(camera.mUp)));
    LayerAuthor& author = ctx.author;
    // In tenths of a scene unit, as UsdGeomCamera wants them
    double width = 20.955, height = 15.2908;
    if (camera.mOrthographicWidth > 0) {
        author.token(prim, "projection", "orthographic");
        width = 20.0 * double(camera.mOrthographicWidth);
        height = camera.mAspect > 0 ? width / double(camera.mAspect) : width;
    } else {
        if (ctx.format == Format::Fbx)
            ctx.diagnostics.note(
                "import-projection", ctx.loc, prim.to_string(),
                "perspective is written: Assimp does not report the projection of .fbx cameras");
        const auto [fov, aspect] = field_of_view(ctx, camera);
        if (aspect > 0.0) height = width / aspect;
        if (is_made_up_angle(ctx, camera))
            ctx.warn("import-camera", "the file has no field of view; 50 mm is used",
                     prim.to_string());
        else if (fov > 0.0 && fov < pi_d)
            author.attribute(prim, "focalLength", "float",
                             Value(float(height / 2 / std::tan(fov / 2))));
        else
            ctx.warn("import-camera",
                     fmt::format("field of view of {} degrees, 50 mm are used", fov * 180 / pi_d),
                     prim.to_string());
    }
    author.attribute(prim, "horizontalAperture", "float", Value(float(width)));
    author.attribute(prim, "verticalAperture", "float", Value(float(height)));
    const float near_plane = float(camera.mClipPlaneNear);
    const float far_plane = float(camera.mClipPlaneFar);
    // glTF cameras may see without an end
    const float end = far_plane > near_plane ? far_plane : 1e6f * std::max(near_plane, 1.0f);
    if (near_plane > 0)
        author.attribute(prim, "clippingRange", "float2", Value(layer::Vec2f(near_plane, end)));
}

}  // namespace velatura::import
