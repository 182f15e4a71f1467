#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>

#include <nook/outcome.hpp>
#include <nook/scene/memory.hpp>
#include <nook/target.hpp>

/// Memory that grows by pages of one size, so that nothing is ever held twice.
namespace nook::inline NOOK_TARGET::detail {

/// A page of words, and the one that follows it in a list.
struct ChannelPage {
    static constexpr std::uint32_t none = 0xffffffff;
    Block block{};
    std::uint32_t next = none;

    [[nodiscard]] std::uint32_t* words() const { return static_cast<std::uint32_t*>(block.data()); }
};

/// Pages by index. They stay where they are until released.
class ChannelPages {
public:
    ChannelPages() = default;
    ChannelPages(const Memory& memory, std::size_t page_size)
        : memory_{memory},
          page_size_{page_size}
    {}
    ChannelPages(ChannelPages&& other) noexcept { swap(other); }
    ChannelPages& operator=(ChannelPages&& other) noexcept
    {
        ChannelPages taken{std::move(other)};
        swap(taken);
        return *this;
    }
    ~ChannelPages()
    {
        for (std::uint32_t i = 0; i < count_; ++i) pages()[i].~ChannelPage();
    }

    /// Adds a page; `ChannelPage::none` when there is no memory.
    [[nodiscard]] std::uint32_t add()
    {
        if (count_ == capacity_ && !grow()) return ChannelPage::none;
        Block block{memory_, page_size_};
        if (block.data() == nullptr) return ChannelPage::none;
        new (pages() + count_) ChannelPage{std::move(block)};
        return count_++;
    }
    void release(std::uint32_t page) { pages()[page].block.reset(); }

    [[nodiscard]] ChannelPage& operator[](std::uint32_t page) const { return pages()[page]; }
    [[nodiscard]] std::uint32_t count() const { return count_; }
    /// Bytes held.
    [[nodiscard]] std::size_t size() const
    {
        std::size_t bytes = table_.size();
        for (std::uint32_t i = 0; i < count_; ++i) bytes += pages()[i].block.size();
        return bytes;
    }

private:
    [[nodiscard]] ChannelPage* pages() const { return static_cast<ChannelPage*>(table_.data()); }

    [[nodiscard]] bool grow()
    {
        const std::uint32_t capacity = capacity_ == 0 ? 16 : 2 * capacity_;
        Block table{memory_, capacity * sizeof(ChannelPage)};
        auto* const moved = static_cast<ChannelPage*>(table.data());
        if (moved == nullptr) return false;
        for (std::uint32_t i = 0; i < count_; ++i) {
            new (moved + i) ChannelPage{std::move(pages()[i])};
            pages()[i].~ChannelPage();
        }
        table_ = std::move(table);
        capacity_ = capacity;
        return true;
    }
    void swap(ChannelPages& other) noexcept
    {
        std::swap(memory_, other.memory_);
        std::swap(page_size_, other.page_size_);
        std::swap(table_, other.table_);
        std::swap(count_, other.count_);
        std::swap(capacity_, other.capacity_);
    }

    Memory memory_{};
    std::size_t page_size_ = 0;
    Block table_{};
    std::uint32_t count_ = 0, capacity_ = 0;
};

/// The memory of a channel.
struct ChannelMemory {
    Block arrays{}, entries{};
    ChannelPages pages{};

    [[nodiscard]] std::size_t size() const { return arrays.size() + entries.size() + pages.size(); }
};

[[nodiscard]] inline Error channel_out_of_memory(std::size_t bytes)
{
    return {ErrorCode::out_of_memory, "memory", double(bytes), "at least that many bytes"};
}

}  // namespace nook::inline NOOK_TARGET::detail
