// SPDX-License-Identifier: Apache-2.0
#include "embree_peer.h"

#include <embree3/rtcore.h>

#include <atomic>
#include <cstring>
#include <limits>

namespace velatura::bench {

struct EmbreePeer::State {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::vector<RTCScene> prototypes;
    std::atomic<long long> bytes{0};
};

namespace {

bool count_memory(void* bytes, ssize_t change, bool) {
    *static_cast<std::atomic<long long>*>(bytes) += change;
    return true;
}

void attach(RTCDevice device, RTCScene scene, const BenchMesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* positions =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(Vec3), mesh.positions.size());
    std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(Vec3));
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(uint32_t), mesh.triangles.size());
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(uint32_t));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

RTCScene new_scene(RTCDevice device) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
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
    r.time = 0;
    r.mask = ~0u;
    r.id = 0;
    r.flags = 0;
}

}  // namespace

EmbreePeer::EmbreePeer(const BenchScene& scene) : state_(std::make_unique<State>()) {
    state_->device = rtcNewDevice("threads=1");
    rtcSetDeviceMemoryMonitorFunction(state_->device, &count_memory, &state_->bytes);
    state_->scene = new_scene(state_->device);
    attach(state_->device, state_->scene, scene.direct);
    for (const BenchMesh& mesh : scene.prototypes) {
        RTCScene prototype = new_scene(state_->device);
        attach(state_->device, prototype, mesh);
        rtcCommitScene(prototype);
        state_->prototypes.push_back(prototype);
    }
    for (const accel::SoupInstance& instance : scene.instances) {
        RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, state_->prototypes[instance.prototype]);
        // Rows of ours are columns of theirs
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                                &instance.render_from_prototype[0][0]);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(state_->scene, geometry);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(state_->scene);
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

size_t EmbreePeer::bytes() const {
    return size_t(state_->bytes.load());
}

}  // namespace velatura::bench
