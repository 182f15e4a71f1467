#include "embree_scene.hpp"

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#if defined(NOOK_COMPARE_EMBREE) && NOOK_COMPARE_EMBREE >= 4
#include <embree4/rtcore.h>
#elif defined(NOOK_COMPARE_EMBREE)
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <vector>

#include "compare/failure.hpp"

namespace compare {

void flush_denormals()
{
#if defined(__SSE2__)
    constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    _mm_setcsr(_mm_getcsr() | flush_to_zero | denormals_are_zero);
#endif
}

#if defined(NOOK_COMPARE_EMBREE)

std::string embree_version() { return RTC_VERSION_STRING; }

struct EmbreeScene::State {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    bool robust = false;
    std::ptrdiff_t bytes = 0;
    std::vector<float> positions;
    std::vector<unsigned> indices;

    ~State()
    {
        if (scene != nullptr) rtcReleaseScene(scene);
        if (device != nullptr) rtcReleaseDevice(device);
    }
};

EmbreeScene::EmbreeScene(const nook::MeshView& mesh, Mode mode) : state_{std::make_unique<State>()}
{
    State& state = *state_;
    state.robust = mode == Mode::robust;
    // Embree reads four floats of a vertex.
    state.positions.assign(mesh.positions, mesh.positions + 3 * mesh.vertex_count);
    state.positions.push_back(0);
    state.indices.assign(mesh.indices, mesh.indices + 3 * mesh.triangle_count);
    state.device = rtcNewDevice("threads=1");
    if (state.device == nullptr) throw Failure{"Embree gives no device"};
    rtcSetDeviceMemoryMonitorFunction(
        state.device,
        [](void* bytes, auto change, bool) {
            *static_cast<std::ptrdiff_t*>(bytes) += change;
            return true;
        },
        &state.bytes);
    build();
}

void EmbreeScene::build()
{
    State& state = *state_;
    if (state.scene != nullptr) rtcReleaseScene(state.scene);
    state.scene = rtcNewScene(state.device);
    rtcSetSceneBuildQuality(state.scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(state.scene, state.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    const RTCGeometry geometry = rtcNewGeometry(state.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               state.positions.data(), 0, 3 * sizeof(float),
                               state.positions.size() / 3);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               state.indices.data(), 0, 3 * sizeof(unsigned),
                               state.indices.size() / 3);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state.scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(state.scene);
    if (rtcGetDeviceError(state.device) != RTC_ERROR_NONE)
        throw Failure{"Embree cannot build the scene"};
}

EmbreeScene::~EmbreeScene() = default;

void* EmbreeScene::handle() const { return state_->scene; }
std::size_t EmbreeScene::memory_size() const
{
    return static_cast<std::size_t>((std::max)(state_->bytes, std::ptrdiff_t{0}));
}

#else

std::string embree_version() { return {}; }

struct EmbreeScene::State {};

EmbreeScene::EmbreeScene(const nook::MeshView&, Mode) {}
void EmbreeScene::build() {}
EmbreeScene::~EmbreeScene() = default;
void* EmbreeScene::handle() const { return nullptr; }
std::size_t EmbreeScene::memory_size() const { return 0; }

#endif

}  // namespace compare
