// SPDX-License-Identifier: Apache-2.0
#include "plugins/embree/embree_accelerator.h"

#include "accel/placement.h"
#include "accel/ray_query.h"
#include "base/floats.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <new>
#include <span>
#include <string>
#include <tuple>
#include <vector>

namespace velatura::plugins::embree {

namespace {

using accel::SoupScene;
using accel::TriangleSoupView;

bool count_memory(void* bytes, ssize_t change, bool) {
    *static_cast<std::atomic<int64_t>*>(bytes) += change;
    return true;
}

// Owns a handle of Embree's.
template <class Handle, void (*release)(Handle)>
class Owned {
  public:
    Owned() = default;

    explicit Owned(Handle handle) : handle_(handle) {}

    Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}

    Owned& operator=(Owned&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }

    ~Owned() {
        if (handle_) release(handle_);
    }

    operator Handle() const { return handle_; }

  private:
    Handle handle_ = nullptr;
};

using Device = Owned<RTCDevice, rtcReleaseDevice>;
using Scene = Owned<RTCScene, rtcReleaseScene>;
using Geometry = Owned<RTCGeometry, rtcReleaseGeometry>;

// Which of two hits with one t wins.
using Rank = std::tuple<uint32_t, uint32_t, uint32_t>;  // instance, shape, triangle

// An instance, as primitives in it need it.
struct Placed {
    accel::InstanceRecord record;
    std::vector<Mat4> keys;  // of one that moves
};

// What the intersection filter and the primitives know of the ray. The first member is Embree's.
struct Context {
    RTCIntersectContext embree;
    uint32_t shape_count = 0;  // direct shapes; geometries of the top scene beyond are instances
    const geometry::Ray* ray = nullptr;
    const std::vector<Placed>* instances = nullptr;  // [instance]
    const accel::SoupClasses* classes = nullptr;
    const scene::LinkSet* met = nullptr;  // null: everything
    float t = std::numeric_limits<float>::infinity();
    Rank rank{scene::none, scene::none, scene::none};
};

// Geometries of the top scene: direct shapes, then instances.
Rank rank_of(const Context& context, uint32_t instance_id, uint32_t geometry, uint32_t triangle) {
    const bool is_direct = instance_id == RTC_INVALID_GEOMETRY_ID;
    return {is_direct ? scene::none : instance_id - context.shape_count, geometry, triangle};
}

bool is_met(const Context& context, const Rank& rank) {
    return !context.met ||
           context.met->holds(context.classes->of(std::get<0>(rank), std::get<1>(rank)));
}

// Rejects a hit on what the ray does not meet, and one as far away as the best one and after it in
// order. Embree offers hits with t <= tfar, so that ties do come here.
void keep_first_of_ties(const RTCFilterFunctionNArguments* args) {
    auto* context = reinterpret_cast<Context*>(args->context);
    const float t = RTCRayN_tfar(args->ray, args->N, 0);
    const Rank rank =
        rank_of(*context, RTCHitN_instID(args->hit, args->N, 0, 0),
                RTCHitN_geomID(args->hit, args->N, 0), RTCHitN_primID(args->hit, args->N, 0));
    if (!(t > 0) || !is_met(*context, rank) || (t == context->t && rank > context->rank)) {
        args->valid[0] = 0;
        return;
    }
    context->t = t;
    context->rank = rank;
}

// The ray as it was asked for, in the space of the primitives that Embree has reached.
// False: what they are in is not there at the time of the ray.
bool place_ray(const Context& context, Vec3d& o, Vec3d& d) {
    const geometry::Ray& ray = *context.ray;
    o = Vec3d(ray.o);
    d = Vec3d(ray.d);
    const uint32_t instance = context.embree.instID[0];
    if (instance == RTC_INVALID_GEOMETRY_ID) return true;
    const Placed& placed = (*context.instances)[instance - context.shape_count];
    accel::InstanceRecord record = placed.record;
    if (!placed.keys.empty() && !accel::place_at_time(placed.keys, ray.time, record)) return false;
    accel::enter(record, ray, o, d);
    return true;
}

// Embree leaves out primitives without a finite box.
void primitive_bounds(const RTCBoundsFunctionArguments* args) {
    const auto& set = *static_cast<const geometry::PrimitiveSet*>(args->geometryUserPtr);
    Box3 box;
    if (!accel::round_outward(set.bounds(args->primID).box, box))
        box.min = box.max = Vec3(std::numeric_limits<float>::quiet_NaN());
    *args->bounds_o = {box.min.x, box.min.y, box.min.z, 0, box.max.x, box.max.y, box.max.z, 0};
}

void intersect_primitive(const RTCIntersectFunctionNArguments* args) {
    if (!args->valid[0]) return;
    const auto& set = *static_cast<const geometry::PrimitiveSet*>(args->geometryUserPtr);
    auto* context = reinterpret_cast<Context*>(args->context);
    auto* query = reinterpret_cast<RTCRayHit*>(args->rayhit);
    const Rank rank = rank_of(*context, context->embree.instID[0], args->geomID, args->primID);
    Vec3d o, d;
    if (!is_met(*context, rank) || !place_ray(*context, o, d)) return;
    const auto found = set.intersect(args->primID, o, d, next_float_up(query->ray.tfar));
    if (!found) return;
    const auto t = float(found->t);
    if (t == context->t && rank > context->rank) return;
    context->t = query->ray.tfar = t;
    context->rank = rank;
    query->hit.u = found->u;
    query->hit.v = found->v;
    query->hit.geomID = args->geomID;
    query->hit.primID = args->primID;
    query->hit.instID[0] = context->embree.instID[0];
}

void occlude_by_primitive(const RTCOccludedFunctionNArguments* args) {
    if (!args->valid[0]) return;
    const auto& set = *static_cast<const geometry::PrimitiveSet*>(args->geometryUserPtr);
    const auto* context = reinterpret_cast<const Context*>(args->context);
    auto* ray = reinterpret_cast<RTCRay*>(args->ray);
    const Rank rank = rank_of(*context, context->embree.instID[0], args->geomID, args->primID);
    Vec3d o, d;
    if (!is_met(*context, rank) || !place_ray(*context, o, d)) return;
    if (set.is_occluded(args->primID, o, d, context->ray->t_max))
        ray->tfar = -std::numeric_limits<float>::infinity();
}

class EmbreeAccelerator final : public accel::Accelerator {
  public:
    // True when everything was built.
    bool build(const SoupScene& scene, std::string& why) {
        const auto start = std::chrono::steady_clock::now();
        device_ = Device(rtcNewDevice(nullptr));
        if (!device_) {
            why = "cannot start Embree";
            return false;
        }
        rtcSetDeviceMemoryMonitorFunction(device_, &count_memory, &bytes_);
        rtcSetDeviceErrorFunction(device_, &keep_error, &why);
        shape_count_ = uint32_t(scene.shapes.size());
        instances_.resize(scene.instances.size());
        classes_ = scene.classes;
        top_ = new_scene();
        bounds_ = attach(top_, scene.shapes);
        std::vector<Box3> prototype_bounds;
        for (const auto& shapes : scene.prototypes) {
            prototypes_.push_back(new_scene());
            prototype_bounds.push_back(attach(prototypes_.back(), shapes));
            rtcCommitScene(prototypes_.back());
        }
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            place(scene.instances[i], prototype_bounds[scene.instances[i].prototype], i);
        }
        rtcCommitScene(top_);
        rtcSetDeviceErrorFunction(device_, nullptr, nullptr);
        stats_.bytes = size_t(std::max<int64_t>(bytes_.load(), 0));
        stats_.build_seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return why.empty();
    }

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        return intersect(ray, nullptr);
    }

    bool is_occluded(const geometry::Ray& ray) const override { return is_occluded(ray, nullptr); }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        return intersect(ray, &met);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        return is_occluded(ray, &met);
    }

    Box3 bounds() const override { return bounds_; }

    accel::AcceleratorStats stats() const override { return stats_; }

  private:
    // met: null = everything.
    geometry::Hit intersect(const geometry::Ray& ray, const scene::LinkSet* met) const {
        geometry::Hit result;
        RTCRayHit query;
        if (!set_ray(query.ray, ray)) return result;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        Context context = new_context(ray, met);
        rtcIntersect1(top_, &context.embree, &query);
        if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return result;
        result.t = query.ray.tfar;
        result.b1 = query.hit.u;
        result.b2 = query.hit.v;
        std::tie(result.instance, result.shape, result.triangle) =
            rank_of(context, query.hit.instID[0], query.hit.geomID, query.hit.primID);
        return result;
    }

    bool is_occluded(const geometry::Ray& ray, const scene::LinkSet* met) const {
        RTCRay query;
        if (!set_ray(query, ray)) return false;
        Context context = new_context(ray, met);
        rtcOccluded1(top_, &context.embree, &query);
        return query.tfar < 0;
    }

    static void keep_error(void* why, RTCError, const char* text) {
        auto& message = *static_cast<std::string*>(why);
        if (message.empty()) message = text && *text ? text : "Embree gives no reason";
    }

    Context new_context(const geometry::Ray& ray, const scene::LinkSet* met) const {
        Context context;
        rtcInitIntersectContext(&context.embree);
        context.embree.filter = &keep_first_of_ties;
        context.shape_count = shape_count_;
        context.ray = &ray;
        context.instances = &instances_;
        context.classes = &classes_;
        context.met = met;
        return context;
    }

    Scene new_scene() const {
        Scene scene(rtcNewScene(device_));
        rtcSetSceneFlags(
            scene, RTCSceneFlags(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
        return scene;
    }

    // False for rays that meet nothing by the rules of Accelerator.
    static bool set_ray(RTCRay& r, const geometry::Ray& ray) {
        if (!velatura::is_finite(ray.o) || !velatura::is_finite(ray.d) || !(ray.t_max > 0))
            return false;
        if (ray.d == Vec3(0)) return false;
        r.org_x = ray.o.x;
        r.org_y = ray.o.y;
        r.org_z = ray.o.z;
        r.dir_x = ray.d.x;
        r.dir_y = ray.d.y;
        r.dir_z = ray.d.z;
        r.tnear = 0;
        // Embree's end is inside
        r.tfar = std::isinf(ray.t_max) ? ray.t_max : next_float_down(ray.t_max);
        r.time = std::min(std::max(0.0f, ray.time), 1.0f);
        r.mask = ~0u;
        r.id = 0;
        r.flags = 0;
        return true;
    }

    // Attaches one geometry per shape, numbered alike. Returns the box of triangles that count.
    Box3 attach(RTCScene scene, const std::vector<TriangleSoupView>& shapes) {
        Box3 box;
        for (size_t i = 0; i < shapes.size(); ++i) attach(scene, shapes[i], unsigned(i), box);
        return box;
    }

    void attach_primitives(RTCScene scene, const TriangleSoupView& shape, unsigned id, Box3& box) {
        const geometry::PrimitiveSet& set = *shape.primitives;
        const Geometry geometry(rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER));
        rtcSetGeometryUserPrimitiveCount(geometry, set.size());
        // Embree does not write to it
        rtcSetGeometryUserData(geometry, const_cast<geometry::PrimitiveSet*>(&set));
        rtcSetGeometryBoundsFunction(geometry, &primitive_bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry, &intersect_primitive);
        rtcSetGeometryOccludedFunction(geometry, &occlude_by_primitive);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, id);
        sets_.push_back(shape.primitives);
        for (uint32_t i = 0; i < set.size(); ++i) {
            Box3 bounds;
            if (!accel::round_outward(set.bounds(i).box, bounds)) continue;
            ++stats_.primitives;
            box.extendBy(bounds);
        }
    }

    static std::span<const Vec3> positions_of(const TriangleSoupView& shape, uint32_t key) {
        return key == 0 ? shape.positions : std::span<const Vec3>(shape.later_positions[key - 1]);
    }

    // Whether the triangle is there; one that moves must have usable corners at all keys.
    static bool counts(const TriangleSoupView& shape, const std::array<uint32_t, 3>& v) {
        if (shape.segments() == 0)
            return !accel::is_degenerate(shape.positions[v[0]], shape.positions[v[1]],
                                         shape.positions[v[2]]);
        for (uint32_t key = 0; key <= shape.segments(); ++key) {
            for (const uint32_t corner : v)
                if (!accel::is_usable(positions_of(shape, key)[corner])) return false;
        }
        return true;
    }

    void attach(RTCScene scene, const TriangleSoupView& shape, unsigned id, Box3& box) {
        if (shape.primitives) return attach_primitives(scene, shape, id, box);
        const Geometry geometry(rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE));
        const size_t vertices = shape.positions.size();
        // Triangles that do not count keep their number but lose their place: Embree drops those
        // with a corner that is not finite
        rtcSetGeometryTimeStepCount(geometry, shape.segments() + 1);
        for (uint32_t key = 0; key <= shape.segments(); ++key) {
            auto* positions = static_cast<Vec3*>(
                rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, key, RTC_FORMAT_FLOAT3,
                                        sizeof(Vec3), vertices + 1));
            if (!positions) return;  // keep_error knows why
            const std::span<const Vec3> from = positions_of(shape, key);
            std::copy(from.begin(), from.end(), positions);
            positions[vertices] = Vec3(std::numeric_limits<float>::quiet_NaN());
        }
        auto* triangles = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    3 * sizeof(uint32_t), shape.triangles.size()));
        if (!triangles && !shape.triangles.empty()) return;
        for (const auto& v : shape.triangles) {
            const bool counts = this->counts(shape, v);
            for (const uint32_t corner : v) *triangles++ = counts ? corner : uint32_t(vertices);
            if (!counts) continue;
            ++stats_.triangles;
            for (uint32_t key = 0; key <= shape.segments(); ++key)
                for (const uint32_t corner : v) box.extendBy(positions_of(shape, key)[corner]);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, id);
    }

    // The same instances as in the own tree.
    void place(const accel::SoupInstance& instance, const Box3& prototype_bounds, size_t index) {
        if (prototype_bounds.isEmpty()) return;
        Placed& placed = instances_[index];
        Box3 box;
        if (!instance.later.empty()) {
            placed.keys = {instance.render_from_prototype};
            placed.keys.insert(placed.keys.end(), instance.later.begin(), instance.later.end());
            std::vector<Box3d> key_boxes;
            if (!accel::place_keys(placed.keys, {&prototype_bounds, 1}, key_boxes)) return;
            for (const Box3d& key_box : key_boxes) {
                Box3 rounded;
                if (!accel::round_outward(key_box, rounded)) return;
                box.extendBy(rounded);
            }
        } else {
            accel::PlacedBox still;
            if (!accel::place(instance.render_from_prototype, {&prototype_bounds, 1}, still) ||
                !accel::round_outward(Box3d(still.lower, still.upper), box))
                return;
            placed.record = still.record;
        }
        bounds_.extendBy(box);
        const Geometry geometry(rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(geometry, prototypes_[instance.prototype]);
        rtcSetGeometryTimeStepCount(geometry, unsigned(instance.later.size()) + 1);
        // Rows of ours are columns of theirs
        for (size_t key = 0; key <= instance.later.size(); ++key)
            rtcSetGeometryTransform(
                geometry, unsigned(key), RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                key == 0 ? &instance.render_from_prototype[0][0] : &instance.later[key - 1][0][0]);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(top_, geometry, shape_count_ + unsigned(index));
        ++stats_.instances;
    }

    // The monitor is called until the device is gone
    std::atomic<int64_t> bytes_{0};
    Device device_;
    std::vector<Scene> prototypes_;
    Scene top_;
    uint32_t shape_count_ = 0;
    std::vector<Placed> instances_;  // [instance]; of those that can be hit
    accel::SoupClasses classes_;
    std::vector<std::shared_ptr<const geometry::PrimitiveSet>> sets_;
    Box3 bounds_;
    accel::AcceleratorStats stats_;
};

}  // namespace

Result<std::unique_ptr<accel::Accelerator>> EmbreeFactory::build(const SoupScene& scene) const {
    try {
        auto accelerator = std::make_unique<EmbreeAccelerator>();
        std::string why;
        if (accelerator->build(scene, why)) {
            return std::unique_ptr<accel::Accelerator>(std::move(accelerator));
        }
        return Error{"accelerator", "Embree: " + why};
    } catch (const std::bad_alloc&) {
        return Error{"accelerator", "Embree: out of memory"};
    }
}

}  // namespace velatura::plugins::embree
