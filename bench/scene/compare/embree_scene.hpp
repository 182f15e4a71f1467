#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <nook/scene/mesh.hpp>

/// Embree's side that is the same for every instruction set.
namespace compare {

/// Embree's version, or empty when the program was built without it.
[[nodiscard]] std::string embree_version();

/// Denormals become 0 on this thread, as Embree asks for.
void flush_denormals();

/// A scene of one mesh, built on the calling thread alone at medium quality. The mesh must outlive it.
class EmbreeScene {
public:
    enum class Mode { plain, robust };

    /// Builds at once. Throws Failure when Embree gives no device.
    EmbreeScene(const nook::MeshView& mesh, Mode mode);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// Builds once more, in place of what was there.
    void build();

    /// For the kernels.
    [[nodiscard]] void* handle() const;
    /// Bytes kept besides the mesh, by Embree's own count.
    [[nodiscard]] std::size_t memory_size() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace compare
