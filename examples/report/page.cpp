#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "../support/files.hpp"
#include "document.hpp"
#include "page_assets.hpp"

namespace report {

namespace fs = std::filesystem;

namespace {

/// Appends RFC 4648 base64.
void append_base64(std::string_view bytes, std::string& out)
{
    static constexpr char digits[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t given = (std::min)(bytes.size() - i, std::size_t{3});
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < given ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            out += k <= given ? digits[bits >> (18 - 6 * k) & 63u] : '=';
    }
}

/// JSON that may stand inside <script>: no text of it opens or closes a tag or a comment.
void append_json(const Json& json, std::string& out)
{
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    out.reserve(out.size() + text.size());
    // Outside of strings JSON has no such character.
    for (const char c : text) {
        if (c == '<') out += "\\u003c";
        else out += c;
    }
}

/// Appends "CELL/NAME":"data:…" to an object of which `first` is still to come. Nothing if there is no
/// such file: the page then says that it has no picture.
void append_picture(const fs::path& cells, const std::string& cell, const std::string& name,
                    bool& first, std::string& out)
{
    const fs::path path = cells / cell / (name + ".jpg");
    if (std::error_code error; !fs::is_regular_file(path, error)) return;
    out += std::exchange(first, false) ? "\n" : ",\n";
    append_json(cell + "/" + name, out);
    out += ":\"data:image/jpeg;base64,";
    append_base64(support::read_file(path), out);
    out += '"';
}

void open_block(const std::string& id, std::string& out)
{
    out += "<script type=\"application/json\" id=\"" + id + "\">{";
}

/// One block per cell, `pictures-N`, so that a browser decodes those that are looked at; the views in
/// colour, which choose the scene, are in a block of their own.
void append_pictures(const Json& report, const fs::path& cells, std::string& out)
{
    bool first = true;
    open_block("pictures-shaded", out);
    for (const Json& cell : report.at("cells"))
        append_picture(cells, cell.at("id"), cell.at("shaded"), first, out);
    out += "}</script>\n";
    std::size_t index = 0;
    for (const Json& cell : report.at("cells")) {
        const std::string id = cell.at("id");
        first = true;
        open_block("pictures-" + std::to_string(index++), out);
        for (const Json& reference : cell.at("references"))
            append_picture(cells, id, reference.at("picture"), first, out);
        if (const Json& field = cell.at("height_field"); !field.is_null())
            append_picture(cells, id, field.at("picture"), first, out);
        for (const Json& result : cell.at("results")) {
            append_picture(cells, id, result.at("id"), first, out);
            if (const Json& plan = result.at("plan");
                !plan.is_null() && !plan.at("picture").is_null())
                append_picture(cells, id, plan.at("picture"), first, out);
        }
        out += "}</script>\n";
    }
}

/// Appends what stands before a mark, and takes it and the mark off.
void append_until(std::string_view mark, std::string_view& rest, std::string& out)
{
    const std::size_t at = rest.find(mark);
    if (at == std::string_view::npos) throw std::logic_error{"page.html: no " + std::string{mark}};
    out += rest.substr(0, at);
    rest.remove_prefix(at + mark.size());
}

}  // namespace

std::string page_of(const Json& report, const fs::path& cells)
{
    std::string out;
    std::string_view rest = page_html();
    append_until("{{style}}", rest, out);
    out += page_css();
    append_until("{{report}}", rest, out);
    append_json(report, out);
    append_until("{{pictures}}", rest, out);
    append_pictures(report, cells, out);
    append_until("{{script}}", rest, out);
    for (const std::string_view part : page_scripts()) {
        out += part;
        out += '\n';
    }
    out += rest;
    return out;
}

}  // namespace report
