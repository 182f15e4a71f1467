#include "light.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#if __has_include(<stb/stb_image.h>)
#include <stb/stb_image.h>
#else
#include <stb_image.h>
#endif

#include "../support/checked.hpp"
#include "../support/failure.hpp"
#include "../support/files.hpp"

namespace information {

namespace {

struct NamedPalette {
    const char* name;
    nook::Palette palette;
};
constexpr NamedPalette named_palettes[] = {{"single-hue", nook::Palette::single_hue},
                                           {"complementary", nook::Palette::complementary},
                                           {"analogous", nook::Palette::analogous},
                                           {"triad", nook::Palette::triad}};
/// Orange.
constexpr double hue = 1 / 12.0;

}  // namespace

Light::Light(const std::string& name)
{
    for (const NamedPalette& known : named_palettes)
        if (name == known.name) {
            palette_ = known.palette;
            return;
        }
    if (name.find('.') == std::string::npos)
        throw support::Failure{"--light: '" + name + "' is neither a picture nor one of " +
                               palettes()};
    const std::string bytes = support::read_file(name, std::uintmax_t{1} << 30);
    const auto* const data = reinterpret_cast<const stbi_uc*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    // The size first: a few bytes may claim any number of pixels.
    int channels = 0;
    if (stbi_info_from_memory(data, size, &width_, &height_, &channels) == 0)
        throw support::Failure{name + ": is not a picture that can be read"};
    if (width_ > 16384 || height_ > 16384)
        throw support::Failure{name + ": has more than 16384 pixels across"};
    const std::unique_ptr<float, void (*)(void*)> decoded{
        stbi_loadf_from_memory(data, size, &width_, &height_, &channels, 3), stbi_image_free};
    if (!decoded) throw support::Failure{name + ": is not a picture that can be read"};
    pixels_.assign(decoded.get(), decoded.get() + 3 * static_cast<std::size_t>(width_) *
                                                      static_cast<std::size_t>(height_));
}

std::vector<float> Light::colours(const std::vector<glm::dvec3>& directions) const
{
    std::vector<float> result(3 * directions.size());
    if (!pixels_.empty()) {
        support::checked(nook::environment_colours(
                             nook::Environment::interleaved(pixels_.data(), width_, height_,
                                                            std::ptrdiff_t{3} * width_),
                             directions.data(), directions.size(), result.data()),
                         "environment_colours");
        return result;
    }
    for (std::size_t v = 0; v < directions.size(); ++v) {
        const glm::vec3 colour = nook::palette_colour(palette_, hue, directions[v]);
        for (int k = 0; k < 3; ++k) result[3 * v + static_cast<std::size_t>(k)] = colour[k];
    }
    return result;
}

std::string Light::palettes()
{
    std::string names;
    for (const NamedPalette& known : named_palettes)
        names += (names.empty() ? "" : ", ") + std::string{known.name};
    return names;
}

}  // namespace information
