#include "store.hpp"

#include <cstdint>
#include <cstdio>
#include <system_error>

#include "../support/failure.hpp"
#include "../support/files.hpp"

namespace report {

namespace {

constexpr const char* file_name = "measured.json";

/// Tells programs apart; the same for all where a program cannot read itself.
std::string program_digest()
{
    std::error_code error;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) return {};
    try {
        const std::string bytes = support::read_file(self);
        return digest(bytes.data(), bytes.size());
    } catch (const support::Failure&) {
        return {};
    }
}

}  // namespace

std::string digest(const void* bytes, std::size_t size)
{
    std::uint64_t hash = 0xcbf29ce484222325;
    const auto* const data = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ data[i]) * 0x100000001b3;
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    return text;
}

Store::Store(std::filesystem::path folder, const Json& key)
    : folder_{std::move(folder)},
      run_{{"program", program_digest()}, {"key", key}}
{}

std::optional<Json> Store::find(const std::string& part, const Json& input) const
{
    const std::filesystem::path file = folder(part) / file_name;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored)) return {};
    // Whatever else lies there is measured again and replaced.
    const Json kept = Json::parse(support::read_file(file), nullptr, false);
    if (!kept.is_object() || !kept.contains("key") || !kept.contains("measured")) return {};
    if (kept.at("key") != key(input) || !kept.at("measured").is_object()) return {};
    return kept.at("measured");
}

void Store::drop(const std::string& part) const
{
    const std::filesystem::path file = folder(part) / file_name;
    std::error_code error;
    std::filesystem::remove(file, error);
    if (error) throw support::Failure{file.string() + ": " + error.message()};
}

void Store::keep(const std::string& part, const Json& input, const Json& measured) const
{
    support::prepare_folder(folder(part));
    support::write_file(folder(part) / file_name,
                        Json{{"key", key(input)}, {"measured", measured}}.dump() + '\n');
}

}  // namespace report
