// SPDX-License-Identifier: Apache-2.0
#include "embree_peer.h"

#include "cpu_clock.h"

#include <embree3/rtcore.h>

#include <atomic>
#include <cstring>
#include <limits>
#include <vector>

namespace velatura::bench {

struct EmbreePeer::State {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<RTCScene> prototypes;
    std::atomic<long long> bytes{0};
    long long mesh_bytes = 0;
    double build_seconds = 0;
};

namespace {

bool count_memory(void* bytes, ssize_t change, bool) {
    *static_cast<std::atomic<long long>*>(bytes) += change;
    return true;
}

void attach(RTCDevice device, RTCScene scene, const accel::TriangleSoupView& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(geometry, mesh.segments() + 1);
    for (uint32_t key = 0; key <= mesh.segments(); ++key) {
        const std::span<const Vec3> from =
            key == 0 ? mesh.positions : std::span<const Vec3>(mesh.later_positions[key - 1]);
        void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, key,
                                                  RTC_FORMAT_FLOAT3, sizeof(Vec3), from.size());
        std::memcpy(positions, from.data(), from.size_bytes());
    }
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(uint32_t), mesh.triangles.size());
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size_bytes());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

RTCScene new_scene(RTCDevice device,
                   EmbreeMode mode,
                   const std::vector<accel::TriangleSoupView>& shapes) {
    RTCScene scene = rtcNewScene(device);
    const bool is_robust = mode == EmbreeMode::RobustMedium;
    rtcSetSceneFlags(scene, is_robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(scene, is_robust ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
    for (const accel::TriangleSoupView& mesh : shapes) attach(device, scene, mesh);
    return scene;
}

void set_ray(RTCRay& r, const geometry::Ray& ray) {
    r.org_x = ray.o.x;
    r.org_y = ray.o.y;
    r.org_z = ray.o.z;
    r.dir_x = ray.d.x;
    r.dir_y = ray.d.y;
    r.dir_z = ray.d.z;
    r.tnear = 0;
    r.tfar = ray.t_max;
    r.time = ray.time;
    r.mask = ~0u;
    r.id = 0;
    r.flags = 0;
}

}  // namespace

EmbreePeer::EmbreePeer(const accel::SoupScene& scene, EmbreeMode mode)
    : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.device = rtcNewDevice("threads=1");
    rtcSetDeviceMemoryMonitorFunction(s.device, &count_memory, &s.bytes);
    s.scene = new_scene(s.device, mode, scene.shapes);
    for (const auto& shapes : scene.prototypes) {
        s.prototypes.push_back(new_scene(s.device, mode, shapes));
    }
    s.mesh_bytes = s.bytes.load();
    const double start = cpu_seconds();
    for (RTCScene prototype : s.prototypes) rtcCommitScene(prototype);
    for (const accel::SoupInstance& instance : scene.instances) {
        RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, s.prototypes[instance.prototype]);
        // Rows of ours are columns of theirs
        rtcSetGeometryTimeStepCount(geometry, unsigned(instance.later.size()) + 1);
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                                &instance.render_from_prototype[0][0]);
        for (size_t key = 0; key < instance.later.size(); ++key)
            rtcSetGeometryTransform(geometry, unsigned(key) + 1, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                                    &instance.later[key][0][0]);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(s.scene, geometry);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(s.scene);
    s.build_seconds = cpu_seconds() - start;
}

EmbreePeer::~EmbreePeer() {
    for (RTCScene scene : state_->prototypes) rtcReleaseScene(scene);
    rtcReleaseScene(state_->scene);
    rtcReleaseDevice(state_->device);
}

float EmbreePeer::closest(const geometry::Ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query;
    set_ray(query.ray, ray);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(state_->scene, &context, &query);
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::infinity()
                                                       : query.ray.tfar;
}

bool EmbreePeer::is_occluded(const geometry::Ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay query;
    set_ray(query, ray);
    rtcOccluded1(state_->scene, &context, &query);
    return query.tfar < 0;
}

size_t EmbreePeer::tree_bytes() const {
    return size_t(state_->bytes.load() - state_->mesh_bytes);
}

size_t EmbreePeer::mesh_bytes() const {
    return size_t(state_->mesh_bytes);
}

double EmbreePeer::build_seconds() const {
    return state_->build_seconds;
}

}  // namespace velatura::bench
