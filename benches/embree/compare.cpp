// Embree on the rays that `cargo bench --bench rays -- --dump DIR` wrote: million rays per second on one core, the best
// of several passes, for each way Embree can trace them. See compare.sh.
//
// Files: DIR/SCENE.triangles holds nine floats a triangle; DIR/SCENE.WAVE.rays eight floats a ray in the order they are
// traced: origin, tmax, direction, 1 if only visibility is asked.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

static std::vector<float> read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) { std::fprintf(stderr, "cannot read %s\n", path.c_str()); std::exit(2); }
    std::vector<float> data(size_t(file.tellg()) / sizeof(float));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(data.data()), std::streamsize(data.size() * sizeof(float)));
    return data;
}

struct Wave {
    std::vector<float> rows;
    size_t count() const { return rows.size() / 8; }
    bool shadow() const { return rows[7] != 0; }
};

template <class Ray> static void fill(Ray& ray, const float* r) {
    ray.org_x = r[0]; ray.org_y = r[1]; ray.org_z = r[2]; ray.tnear = 0;
    ray.tfar = r[3]; ray.dir_x = r[4]; ray.dir_y = r[5]; ray.dir_z = r[6];
    ray.time = 0; ray.mask = ~0u; ray.id = 0; ray.flags = 0;
}

enum Mode { SINGLE, PACKET, COHERENT, STREAM, STREAM_COHERENT };

#if RTC_VERSION_MAJOR >= 4
struct Arguments {
    RTCIntersectArguments intersect; RTCOccludedArguments occluded;
    explicit Arguments(bool coherent) {
        rtcInitIntersectArguments(&intersect); rtcInitOccludedArguments(&occluded);
        if (coherent) intersect.flags = occluded.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    }
};
#define CLOSEST(width, ray) rtcIntersect##width(scene, ray, &arguments.intersect)
#define CLOSEST8(ray) rtcIntersect8(valid, scene, ray, &arguments.intersect)
#define ANY(width, ray) rtcOccluded##width(scene, ray, &arguments.occluded)
#define ANY8(ray) rtcOccluded8(valid, scene, ray, &arguments.occluded)
#else
struct Arguments {
    RTCIntersectContext context;
    explicit Arguments(bool coherent) {
        rtcInitIntersectContext(&context);
        context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    }
};
#define CLOSEST(width, ray) rtcIntersect##width(scene, &arguments.context, ray)
#define CLOSEST8(ray) rtcIntersect8(valid, scene, &arguments.context, ray)
#define ANY(width, ray) rtcOccluded##width(scene, &arguments.context, ray)
#define ANY8(ray) rtcOccluded8(valid, scene, &arguments.context, ray)
#endif

// Traces the wave once and returns the number of hits. Rays are filled anew each pass, as a renderer does.
static size_t trace(RTCScene scene, const Wave& wave, Mode mode) {
    const size_t n = wave.count();
    const float* rows = wave.rows.data();
    Arguments arguments(mode == COHERENT || mode == STREAM_COHERENT);
    const bool shadow = wave.shadow();
    size_t hits = 0;
    if (mode == SINGLE) {
        for (size_t i = 0; i < n; i++) {
            alignas(16) RTCRayHit hit;
            fill(hit.ray, rows + 8 * i);
            if (shadow) { ANY(1, &hit.ray); hits += hit.ray.tfar < 0; }
            else { hit.hit.geomID = hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID; CLOSEST(1, &hit); hits += hit.hit.geomID != RTC_INVALID_GEOMETRY_ID; }
        }
    } else if (mode == PACKET || mode == COHERENT) {
        alignas(32) int valid[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
        for (size_t i = 0; i + 8 <= n; i += 8) {
            alignas(32) RTCRayHit8 hit;
            for (size_t k = 0; k < 8; k++) {
                const float* r = rows + 8 * (i + k);
                hit.ray.org_x[k] = r[0]; hit.ray.org_y[k] = r[1]; hit.ray.org_z[k] = r[2]; hit.ray.tnear[k] = 0;
                hit.ray.tfar[k] = r[3]; hit.ray.dir_x[k] = r[4]; hit.ray.dir_y[k] = r[5]; hit.ray.dir_z[k] = r[6];
                hit.ray.time[k] = 0; hit.ray.mask[k] = ~0u; hit.ray.id[k] = 0; hit.ray.flags[k] = 0;
                hit.hit.geomID[k] = hit.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
            }
            if (shadow) { ANY8(reinterpret_cast<RTCRay8*>(&hit.ray)); for (int k = 0; k < 8; k++) hits += hit.ray.tfar[k] < 0; }
            else { CLOSEST8(&hit); for (int k = 0; k < 8; k++) hits += hit.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID; }
        }
    }
#if RTC_VERSION_MAJOR < 4
    else {
        const size_t chunk = 1024;
        static RTCRayHit stream[chunk];
        static RTCRay shadows[chunk];
        for (size_t i = 0; i < n; i += chunk) {
            const size_t m = std::min(chunk, n - i);
            for (size_t k = 0; k < m; k++) {
                fill(shadow ? shadows[k] : stream[k].ray, rows + 8 * (i + k));
                stream[k].hit.geomID = stream[k].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            }
            if (shadow) { rtcOccluded1M(scene, &arguments.context, shadows, unsigned(m), sizeof(RTCRay)); for (size_t k = 0; k < m; k++) hits += shadows[k].tfar < 0; }
            else { rtcIntersect1M(scene, &arguments.context, stream, unsigned(m), sizeof(RTCRayHit)); for (size_t k = 0; k < m; k++) hits += stream[k].hit.geomID != RTC_INVALID_GEOMETRY_ID; }
        }
    }
#endif
    return hits;
}

int main(int argc, char** argv) {
    if (argc < 2) { std::fprintf(stderr, "usage: compare DIR\n"); return 2; }
    std::vector<std::filesystem::path> scenes;
    for (const auto& entry : std::filesystem::directory_iterator(argv[1]))
        if (entry.path().extension() == ".triangles") scenes.push_back(entry.path());
    std::sort(scenes.begin(), scenes.end(), [](auto& a, auto& b) { return std::filesystem::file_size(a) < std::filesystem::file_size(b); });
    const char* names[] = {"single", "packet 8", "coherent 8", "stream", "coherent stream"};
    const int modes = RTC_VERSION_MAJOR < 4 ? 5 : 3;
    RTCDevice device = rtcNewDevice("threads=1");
    std::printf("Embree %s\n", RTC_VERSION_STRING);
    for (const auto& path : scenes) {
        const auto triangles = read(path);
        for (int robust = 0; robust < 2; robust++) {
            RTCScene scene = rtcNewScene(device);
            rtcSetSceneFlags(scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
            rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
            RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
            const size_t n = triangles.size() / 9;
            void* vertices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * n);
            std::memcpy(vertices, triangles.data(), triangles.size() * sizeof(float));
            auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, n));
            for (size_t i = 0; i < 3 * n; i++) indices[i] = unsigned(i);
            rtcCommitGeometry(mesh);
            rtcAttachGeometry(scene, mesh);
            rtcReleaseGeometry(mesh);
            const auto start = std::chrono::steady_clock::now();
            rtcCommitScene(scene);
            const double built = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            std::printf("%s, %s, %zu triangles, built in %.2f s\n", path.stem().c_str(), robust ? "robust" : "default", n, built);
            std::vector<std::filesystem::path> waves;
            for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
                const auto name = entry.path().filename().string();
                if (entry.path().extension() == ".rays" && name.rfind(path.stem().string() + ".", 0) == 0) waves.push_back(entry.path());
            }
            std::sort(waves.begin(), waves.end());
            for (const auto& file : waves) {
                const Wave wave{read(file)};
                const auto name = file.stem().extension().string().substr(1);
                std::printf("  %-20s", name.c_str());
                double best = 0;
                size_t hits = 0;
                for (int mode = 0; mode < modes; mode++) {
                    double fastest = 1e30;
                    for (int pass = 0; pass < 7; pass++) {
                        const auto begin = std::chrono::steady_clock::now();
                        hits = trace(scene, wave, Mode(mode));
                        fastest = std::min(fastest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
                    }
                    const double rate = double(wave.count()) / fastest * 1e-6;
                    best = std::max(best, rate);
                    std::printf("  %s %6.2f", names[mode], rate);
                }
                std::printf("  best %6.2f Mrays/s, %zu hits\n", best, hits);
            }
            rtcReleaseScene(scene);
        }
    }
    rtcReleaseDevice(device);
}
