// The slice under Verilator with everything around it: clock, memory behind fixed-latency AXI ports, tile descriptors,
// and the traces. Driven from golden/cosim/model.py through the C functions at the end.
//
// A cycle: inputs are set, clk falls and the outputs settle, the beats that will move are noted, clk rises. A read's first
// beat is there `read` cycles behind its AR, a B `write` cycles behind the last W beat; with jitter later by late(). With
// a stall every valid and ready that is driven here pauses at random.

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "Vgs_slice.h"
#include "verilated.h"

namespace {

constexpr int CORES = 4;
constexpr uint32_t RGB_WORDS = (12 * ACC_W + 31) / 32;  // ACC_W, the bits of an accumulator, is the compiler's argument
constexpr int READS = 2 * CORES + 2;   // sort 0..3, insert 0..3, table, feature
constexpr int WRITES = CORES + 2;      // sort 0..3, table, pixel
enum Status { RUNNING, FINISHED, STUCK, FAULT };

struct Memory {
    uint8_t* data;
    uint64_t size;
};

// A queue in a ring that grows
template <typename T>
class Queue {
    std::vector<T> ring = std::vector<T>(64);
    uint64_t head = 0;
    uint64_t tail = 0;

public:
    bool empty() const { return head == tail; }
    uint64_t size() const { return tail - head; }
    T& front() { return ring[head & (ring.size() - 1)]; }
    void pop() { ++head; }
    void push(const T& value) {
        if (tail - head == ring.size()) {
            std::vector<T> wide(2 * ring.size());
            for (uint64_t k = head; k != tail; ++k) wide[k & (wide.size() - 1)] = ring[k & (ring.size() - 1)];
            ring.swap(wide);
        }
        ring[tail++ & (ring.size() - 1)] = value;
    }
    void clear() { head = tail = 0; }
};

// Whether a driven valid or ready may be high in this cycle: runs of both, lengths 1..16, mostly short
class Stall {
    uint64_t state = 0;
    int left = 0;
    bool go = true;

    uint32_t next() {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        return uint32_t(state >> 32);
    }

public:
    void seed(uint64_t value) {
        state = value ? value * 0x9e3779b97f4a7c15ull | 1 : 0;
        left = 0;
        go = true;
    }
    bool operator()() {
        if (!state) return true;
        if (left-- == 0) {
            uint32_t r = next();
            go = r & 1;
            left = (r >> 1 & 3) ? 0 : int(r >> 3 & 15);
        }
        return go;
    }
};

// By how many cycles burst number `burst` of a port is answered later: golden/dma.py, late
uint64_t late(uint64_t jitter, uint64_t seed, uint64_t port, uint64_t burst) {
    if (!jitter) return 0;
    uint64_t x = seed << 40 ^ port << 32 ^ burst;
    for (int k = 0; k < 3; ++k) x = (x ^ x >> 32) * 0xd6e8feb86659fd93ull;
    return (x >> 32) % (jitter + 1) >> (x >> 29 & 7);
}

struct Burst {
    uint64_t address;
    uint32_t beats;
    uint64_t due;
};

struct ReadPort {
    Queue<Burst> bursts;
    Stall ar_stall, r_stall;
    bool arready = false;
    bool rvalid = false;
    uint64_t beats = 0, count = 0;

    void clear() {
        bursts.clear();
        arready = rvalid = false;
        beats = count = 0;
    }
};

struct WritePort {
    Queue<Burst> open;          // bursts that miss beats
    Queue<uint64_t> answers;    // first cycle of each B
    struct Beat {
        uint32_t data[4];
        uint32_t strb;
        bool last;
    };
    Queue<Beat> early;          // beats whose AW has not come
    Stall aw_stall, w_stall, b_stall;
    bool awready = false, wready = false, bvalid = false;
    uint64_t beats = 0, count = 0, answered = 0;

    void clear() {
        open.clear();
        answers.clear();
        early.clear();
        awready = wready = bvalid = false;
        beats = count = answered = 0;
    }
};

struct Tile {
    int64_t x, y, table_addr, table_n, in_addr, in_n, scratch_addr, out_addr;
};

}  // namespace

struct Slice {
    VerilatedContext context;
    std::unique_ptr<Vgs_slice> top;
    Memory memory{};
    uint64_t read_latency = 40, write_latency = 20, jitter = 0, jitter_seed = 0;
    ReadPort reads[READS];
    WritePort writes[WRITES];
    Stall tile_stall, done_stall;

    // the frame
    const Tile* tiles = nullptr;
    int64_t tile_count = 0, width = 0, height = 0;
    int64_t *accepted = nullptr, *sorted = nullptr, *px_first = nullptr, *px_last = nullptr, *done = nullptr;
    int64_t *done_n = nullptr, *blends = nullptr;
    uint64_t* bitmaps = nullptr;
    int64_t bitmap_room = 0;
    int32_t* value = nullptr;

    // where it stands
    uint64_t cycle = 0, last_event = 0, watchdog = 200000;
    int64_t sent = 0, finished = 0, sorted_of[CORES] = {}, drawn = 0, px_tile = 0, px_row = 0, px_column = 0;
    int64_t entries = 0, batch = 0;
    bool tile_valid = false, done_ready = false;
    std::string message;

    Slice(uint8_t* data, uint64_t size) {
        context.threads(1);
        context.randReset(0);
        top = std::make_unique<Vgs_slice>(&context, "slice");
        memory = {data, size};
    }
    ~Slice() { top->final(); }

    void stall(uint64_t value) {
        uint64_t k = value ? value * 1000 : 0;
        for (ReadPort& p : reads) p.ar_stall.seed(k ? ++k : 0), p.r_stall.seed(k ? ++k : 0);
        for (WritePort& p : writes) {
            p.aw_stall.seed(k ? ++k : 0);
            p.w_stall.seed(k ? ++k : 0);
            p.b_stall.seed(k ? ++k : 0);
        }
        tile_stall.seed(k ? ++k : 0);
        done_stall.seed(k ? ++k : 0);
    }

    bool fault(const std::string& text) {
        if (message.empty()) message = text;
        return false;
    }

    bool inside(const char* what, int port, uint64_t address, uint64_t bytes) {
        if (address + bytes <= memory.size && address / 4096 == (address + bytes - 1) / 4096) return true;
        char text[120];
        snprintf(text, sizeof text, "%s port %d: burst of %llu bytes at 0x%llx is outside of the memory or crosses 4 KB",
                 what, port, (unsigned long long)bytes, (unsigned long long)address);
        return fault(text);
    }

    void reset() {
        for (ReadPort& p : reads) p.clear();
        for (WritePort& p : writes) p.clear();
        tile_valid = done_ready = false;
        top->rst = 1;
        for (int k = 0; k < 4; ++k) {
            drive_idle();
            top->clk = 0;
            top->eval();
            top->clk = 1;
            top->eval();
        }
        top->rst = 0;
    }

    void drive_idle() {
        top->tile_valid = 0;
        top->done_ready = 0;
        top->m_axi_sort_arready = top->m_axi_sort_rvalid = top->m_axi_insert_arready = top->m_axi_insert_rvalid = 0;
        top->m_axi_sort_awready = top->m_axi_sort_wready = top->m_axi_sort_bvalid = 0;
        top->m_axi_table_arready = top->m_axi_table_rvalid = top->m_axi_table_awready = top->m_axi_table_wready = 0;
        top->m_axi_table_bvalid = top->m_axi_feature_arready = top->m_axi_feature_rvalid = 0;
        top->m_axi_pixel_awready = top->m_axi_pixel_wready = top->m_axi_pixel_bvalid = 0;
        top->m_axi_sort_rresp = top->m_axi_sort_bresp = top->m_axi_insert_rresp = 0;
        top->m_axi_table_rresp = top->m_axi_table_bresp = top->m_axi_feature_rresp = top->m_axi_pixel_bresp = 0;
    }

    // Beats that move at this edge
    void take_ar(int port, uint64_t address, uint32_t beats) {
        ReadPort& p = reads[port];
        if (!inside("read", port, address, beats * 8ull)) return;
        p.bursts.push({address, beats, cycle + read_latency + late(jitter, jitter_seed, port, p.count)});
        ++p.count;
        last_event = cycle;
    }

    void take_r(int port) {
        ReadPort& p = reads[port];
        Burst& b = p.bursts.front();
        b.address += 8;
        if (--b.beats == 0) p.bursts.pop();
        p.rvalid = false;
        ++p.beats;
        last_event = cycle;
    }

    void take_aw(int port, uint64_t address, uint32_t beats, uint32_t bytes) {
        WritePort& p = writes[port];
        if (!inside("write", port, address, uint64_t(beats) * bytes)) return;
        p.open.push({address, beats, 0});
        ++p.count;
        last_event = cycle;
    }

    void take_w(int port, const uint32_t* data, uint32_t words, uint32_t strb, bool last) {
        WritePort::Beat beat{};
        memcpy(beat.data, data, 4 * words);
        beat.strb = strb;
        beat.last = last;
        writes[port].early.push(beat);
        ++writes[port].beats;
        last_event = cycle;
    }

    void store(int port, uint32_t bytes) {
        WritePort& p = writes[port];
        while (!p.open.empty() && !p.early.empty()) {
            Burst& b = p.open.front();
            WritePort::Beat& beat = p.early.front();
            const uint8_t* from = reinterpret_cast<const uint8_t*>(beat.data);
            if (beat.strb == (1u << bytes) - 1)
                memcpy(memory.data + b.address, from, bytes);
            else
                for (uint32_t k = 0; k < bytes; ++k)
                    if (beat.strb >> k & 1) memory.data[b.address + k] = from[k];
            b.address += bytes;
            bool last = --b.beats == 0;
            if (last != beat.last) fault("write port " + std::to_string(port) + ": wlast is in the wrong beat");
            if (last) {
                p.open.pop();
                p.answers.push(cycle + write_latency + late(jitter, jitter_seed, READS + port, p.answered++));
            }
            p.early.pop();
        }
    }

    // What is offered in the next cycle
    bool offer_r(int port, uint64_t& data, bool& last) {
        ReadPort& p = reads[port];
        p.arready = p.ar_stall();
        if (p.rvalid || p.bursts.empty() || p.bursts.front().due > cycle + 1 || !p.r_stall()) return false;
        p.rvalid = true;
        memcpy(&data, memory.data + p.bursts.front().address, 8);
        last = p.bursts.front().beats == 1;
        return true;
    }

    void offer_b(int port) {
        WritePort& p = writes[port];
        p.awready = p.aw_stall();
        p.wready = p.w_stall();
        if (!p.bvalid && !p.answers.empty() && p.answers.front() <= cycle + 1 && p.b_stall()) p.bvalid = true;
    }

    void trace() {
        for (uint32_t done_now = top->trace_sort_done; done_now; done_now &= done_now - 1) {
            int core = __builtin_ctz(done_now);
            sorted[core + CORES * sorted_of[core]++] = int64_t(cycle);
        }
        if (top->trace_itu_valid) {
            uint32_t slot = top->trace_itu_slot, group = top->trace_itu_group;
            if (group == 0) {
                if (slot == 0) batch = entries;
                ++entries;
                if (entries > bitmap_room) {
                    fault("more entries tested than were listed");
                    entries = bitmap_room;
                } else {
                    bitmaps[batch + slot] = 0;
                }
            }
            if (batch + slot < bitmap_room) bitmaps[batch + slot] |= uint64_t(top->trace_itu_hits) << (4 * group);
            last_event = cycle;
        }
        if (top->trace_blend_valid) {
            for (int unit = 0; unit < 4; ++unit)
                if (top->trace_blend_valid >> unit & 1)
                    blends[drawn < tile_count ? drawn : tile_count - 1] +=
                        __builtin_popcountll(top->trace_blend >> (16 * unit) & 0xffff);
            last_event = cycle;
        }
        if (top->trace_px_valid) pixels();
        if (top->trace_tile_done) ++drawn;
    }

    void pixels() {
        const Tile& t = tiles[px_tile];
        if (px_row == 0 && px_column == 0) px_first[px_tile] = int64_t(cycle);
        px_last[px_tile] = int64_t(cycle);
        for (int64_t k = 0; k < 4; ++k) {
            int64_t x = t.x + px_column + k;
            if (x >= width) break;
            for (int channel = 0; channel < 3; ++channel) {
                uint32_t at = uint32_t(3 * k + channel) * ACC_W;
                uint64_t wide = top->trace_px_rgb[at / 32];
                if (at / 32 + 1 < RGB_WORDS) wide |= uint64_t(top->trace_px_rgb[at / 32 + 1]) << 32;
                value[((t.y + px_row) * width + x) * 3 + channel] = int32_t(wide >> at % 32 & ((1u << ACC_W) - 1));
            }
        }
        px_column += 4;
        if (px_column == 64 || t.x + px_column >= width) {
            px_column = 0;
            if (++px_row == 64 || t.y + px_row >= height) px_row = 0, ++px_tile;
        }
        last_event = cycle;
    }

    void step();
    Status run(int64_t cycles);
    void explain();
};

void Slice::step() {
    top->clk = 0;
    top->eval();

    // AR, R
    for (uint32_t m = top->m_axi_sort_arvalid & top->m_axi_sort_arready; m; m &= m - 1) {
        int c = __builtin_ctz(m);
        take_ar(c, top->m_axi_sort_araddr[c], (top->m_axi_sort_arlen >> 8 * c & 255) + 1);
    }
    for (uint32_t m = top->m_axi_insert_arvalid & top->m_axi_insert_arready; m; m &= m - 1) {
        int c = __builtin_ctz(m);
        take_ar(CORES + c, top->m_axi_insert_araddr[c], (top->m_axi_insert_arlen >> 8 * c & 255) + 1);
    }
    if (top->m_axi_table_arvalid & top->m_axi_table_arready)
        take_ar(2 * CORES, top->m_axi_table_araddr, top->m_axi_table_arlen + 1);
    if (top->m_axi_feature_arvalid & top->m_axi_feature_arready)
        take_ar(2 * CORES + 1, top->m_axi_feature_araddr, top->m_axi_feature_arlen + 1);
    for (uint32_t m = top->m_axi_sort_rvalid & top->m_axi_sort_rready; m; m &= m - 1) take_r(__builtin_ctz(m));
    for (uint32_t m = top->m_axi_insert_rvalid & top->m_axi_insert_rready; m; m &= m - 1) take_r(CORES + __builtin_ctz(m));
    if (top->m_axi_table_rvalid & top->m_axi_table_rready) take_r(2 * CORES);
    if (top->m_axi_feature_rvalid & top->m_axi_feature_rready) take_r(2 * CORES + 1);

    // AW, W, B
    for (uint32_t m = top->m_axi_sort_awvalid & top->m_axi_sort_awready; m; m &= m - 1) {
        int c = __builtin_ctz(m);
        take_aw(c, top->m_axi_sort_awaddr[c], (top->m_axi_sort_awlen >> 8 * c & 255) + 1, 8);
    }
    if (top->m_axi_table_awvalid & top->m_axi_table_awready)
        take_aw(CORES, top->m_axi_table_awaddr, top->m_axi_table_awlen + 1, 8);
    if (top->m_axi_pixel_awvalid & top->m_axi_pixel_awready)
        take_aw(CORES + 1, top->m_axi_pixel_awaddr, top->m_axi_pixel_awlen + 1, 16);
    for (uint32_t m = top->m_axi_sort_wvalid & top->m_axi_sort_wready; m; m &= m - 1) {
        int c = __builtin_ctz(m);
        take_w(c, &top->m_axi_sort_wdata[2 * c], 2, top->m_axi_sort_wstrb >> 8 * c & 255, top->m_axi_sort_wlast >> c & 1);
    }
    if (top->m_axi_table_wvalid & top->m_axi_table_wready) {
        uint64_t data = top->m_axi_table_wdata;
        uint32_t words[2] = {uint32_t(data), uint32_t(data >> 32)};
        take_w(CORES, words, 2, top->m_axi_table_wstrb, top->m_axi_table_wlast);
    }
    if (top->m_axi_pixel_wvalid & top->m_axi_pixel_wready)
        take_w(CORES + 1, &top->m_axi_pixel_wdata[0], 4, top->m_axi_pixel_wstrb, top->m_axi_pixel_wlast);
    for (int port = 0; port < WRITES; ++port)
        if (!writes[port].early.empty() && !writes[port].open.empty()) store(port, port == WRITES - 1 ? 16 : 8);
    uint32_t b = (top->m_axi_sort_bvalid & top->m_axi_sort_bready) |
                 (top->m_axi_table_bvalid & top->m_axi_table_bready) << CORES |
                 (top->m_axi_pixel_bvalid & top->m_axi_pixel_bready) << (CORES + 1);
    for (; b; b &= b - 1) {
        WritePort& p = writes[__builtin_ctz(b)];
        p.bvalid = false;
        p.answers.pop();
        last_event = cycle;
    }

    // Tiles and traces
    if (tile_valid && top->tile_ready) {
        accepted[sent++] = int64_t(cycle);
        tile_valid = false;
        last_event = cycle;
    }
    if (top->done_valid && done_ready) {
        done[finished] = int64_t(cycle);
        done_n[finished++] = int64_t(top->done_n);
        last_event = cycle;
    }
    trace();

    top->clk = 1;
    top->eval();

    // Inputs of the next cycle
    uint32_t sort_arready = 0, sort_rvalid = 0, insert_arready = 0, insert_rvalid = 0, awready = 0, wready = 0, bvalid = 0;
    uint64_t data;
    bool last;
    for (int c = 0; c < CORES; ++c) {
        if (offer_r(c, data, last)) {
            memcpy(&top->m_axi_sort_rdata[2 * c], &data, 8);
            top->m_axi_sort_rlast = (top->m_axi_sort_rlast & ~(1u << c)) | uint32_t(last) << c;
        }
        if (offer_r(CORES + c, data, last)) {
            memcpy(&top->m_axi_insert_rdata[2 * c], &data, 8);
            top->m_axi_insert_rlast = (top->m_axi_insert_rlast & ~(1u << c)) | uint32_t(last) << c;
        }
        sort_arready |= uint32_t(reads[c].arready) << c;
        sort_rvalid |= uint32_t(reads[c].rvalid) << c;
        insert_arready |= uint32_t(reads[CORES + c].arready) << c;
        insert_rvalid |= uint32_t(reads[CORES + c].rvalid) << c;
    }
    if (offer_r(2 * CORES, data, last)) {
        top->m_axi_table_rdata = data;
        top->m_axi_table_rlast = last;
    }
    if (offer_r(2 * CORES + 1, data, last)) {
        top->m_axi_feature_rdata = data;
        top->m_axi_feature_rlast = last;
    }
    for (int port = 0; port < WRITES; ++port) {
        offer_b(port);
        awready |= uint32_t(writes[port].awready) << port;
        wready |= uint32_t(writes[port].wready) << port;
        bvalid |= uint32_t(writes[port].bvalid) << port;
    }
    top->m_axi_sort_arready = sort_arready;
    top->m_axi_sort_rvalid = sort_rvalid;
    top->m_axi_insert_arready = insert_arready;
    top->m_axi_insert_rvalid = insert_rvalid;
    top->m_axi_table_arready = reads[2 * CORES].arready;
    top->m_axi_table_rvalid = reads[2 * CORES].rvalid;
    top->m_axi_feature_arready = reads[2 * CORES + 1].arready;
    top->m_axi_feature_rvalid = reads[2 * CORES + 1].rvalid;
    constexpr uint32_t SORTS = (1 << CORES) - 1;
    top->m_axi_sort_awready = awready & SORTS;
    top->m_axi_sort_wready = wready & SORTS;
    top->m_axi_sort_bvalid = bvalid & SORTS;
    top->m_axi_table_awready = awready >> CORES & 1;
    top->m_axi_table_wready = wready >> CORES & 1;
    top->m_axi_table_bvalid = bvalid >> CORES & 1;
    top->m_axi_pixel_awready = awready >> (CORES + 1) & 1;
    top->m_axi_pixel_wready = wready >> (CORES + 1) & 1;
    top->m_axi_pixel_bvalid = bvalid >> (CORES + 1) & 1;
    if (!tile_valid && sent < tile_count && tile_stall()) {
        const Tile& t = tiles[sent];
        tile_valid = true;
        top->tile_x = t.x;
        top->tile_y = t.y;
        top->tile_table_addr = t.table_addr;
        top->tile_table_n = t.table_n;
        top->tile_in_addr = t.in_addr;
        top->tile_in_n = t.in_n;
        top->tile_scratch_addr = t.scratch_addr;
        top->tile_out_addr = t.out_addr;
    }
    top->tile_valid = tile_valid;
    done_ready = done_stall();
    top->done_ready = done_ready;
    ++cycle;
}

Status Slice::run(int64_t cycles) {
    for (int64_t k = 0; k < cycles; ++k) {
        if (finished == tile_count) return FINISHED;
        step();
        if (top->error) fault("the slice reports a memory error");
        if (!message.empty()) return FAULT;
        if (cycle - last_event > watchdog) {
            explain();
            return STUCK;
        }
    }
    return finished == tile_count ? FINISHED : RUNNING;
}

void Slice::explain() {
    char text[200];
    int64_t sorts = 0;
    for (int c = 0; c < CORES; ++c) sorts += sorted_of[c];
    snprintf(text, sizeof text, "nothing has moved since cycle %llu: of %lld tiles %lld taken, %lld sorted, %lld drawn, %lld done;",
             (unsigned long long)last_event, (long long)tile_count, (long long)sent, (long long)sorts, (long long)drawn,
             (long long)finished);
    message = text;
    if (sent < tile_count && tile_valid) message += " sort lane " + std::to_string(sent % CORES) + " takes no tile;";
    for (int c = 0; c < CORES; ++c) {
        int64_t given = (sent - c + CORES - 1) / CORES;
        if (sorted_of[c] < given)
            message += " sort lane " + std::to_string(c) + " is in tile " + std::to_string(c + CORES * sorted_of[c]) + ";";
    }
    if (drawn < tile_count) message += " the raster core is in tile " + std::to_string(drawn) + ";";
    static const char* const READ_NAMES[] = {"sort 0", "sort 1", "sort 2", "sort 3", "insert 0", "insert 1", "insert 2", "insert 3", "table", "feature"};
    static const char* const WRITE_NAMES[] = {"sort 0", "sort 1", "sort 2", "sort 3", "table", "pixel"};
    for (int k = 0; k < READS; ++k)
        if (!reads[k].bursts.empty())
            message += std::string(" port ") + READ_NAMES[k] + " leaves " + std::to_string(reads[k].bursts.size()) + " read bursts;";
    for (int k = 0; k < WRITES; ++k)
        if (!writes[k].open.empty() || !writes[k].early.empty())
            message += std::string(" port ") + WRITE_NAMES[k] + " has begun a write burst;";
}

extern "C" {

Slice* slice_new(uint8_t* data, uint64_t size) { return new Slice(data, size); }
void slice_free(Slice* s) { delete s; }
// jitter: answers come up to so many cycles later, drawn from seed. stall: not 0 pauses every handshake at random
void slice_timing(Slice* s, uint64_t read, uint64_t write, uint64_t jitter, uint64_t seed, uint64_t stall,
                  uint64_t watchdog) {
    s->read_latency = read;
    s->write_latency = write;
    s->jitter = jitter;
    s->jitter_seed = seed;
    s->stall(stall);
    s->watchdog = watchdog;
}
// config: width, height, background red, green, blue, feature address, frame address, frame stride, first
void slice_start(Slice* s, const int64_t* config, const int64_t* tiles, int64_t count, int64_t* accepted, int64_t* sorted,
                 int64_t* px_first, int64_t* px_last, int64_t* done, int64_t* done_n, int64_t* blends, uint64_t* bitmaps,
                 int64_t room, int32_t* value) {
    s->width = config[0];
    s->height = config[1];
    s->top->cfg_width = config[0];
    s->top->cfg_height = config[1];
    s->top->cfg_bg_red = config[2];
    s->top->cfg_bg_green = config[3];
    s->top->cfg_bg_blue = config[4];
    s->top->cfg_feature_addr = config[5];
    s->top->cfg_frame_addr = config[6];
    s->top->cfg_frame_stride = config[7];
    s->top->cfg_first = config[8];
    s->tiles = reinterpret_cast<const Tile*>(tiles);
    s->tile_count = count;
    s->accepted = accepted;
    s->sorted = sorted;
    s->px_first = px_first;
    s->px_last = px_last;
    s->done = done;
    s->done_n = done_n;
    s->blends = blends;
    s->bitmaps = bitmaps;
    s->bitmap_room = room;
    s->value = value;
    s->message.clear();
    s->sent = s->finished = s->drawn = s->px_tile = s->px_row = s->px_column = s->entries = s->batch = 0;
    for (int64_t& n : s->sorted_of) n = 0;
    s->reset();
    s->cycle = s->last_event = 0;
}
int slice_run(Slice* s, int64_t cycles) { return s->run(cycles); }
// progress: cycle, tiles taken, drawn, done, entries tested
void slice_progress(Slice* s, int64_t* progress) {
    progress[0] = int64_t(s->cycle);
    progress[1] = s->sent;
    progress[2] = s->drawn;
    progress[3] = s->finished;
    progress[4] = s->entries;
}
// beats and bursts of the 10 read and the 6 write ports
void slice_counters(Slice* s, int64_t* counters) {
    for (ReadPort& p : s->reads) *counters++ = int64_t(p.beats), *counters++ = int64_t(p.count);
    for (WritePort& p : s->writes) *counters++ = int64_t(p.beats), *counters++ = int64_t(p.count);
}
uint64_t slice_late(uint64_t jitter, uint64_t seed, uint64_t port, uint64_t burst) { return late(jitter, seed, port, burst); }
const char* slice_message(Slice* s) { return s->message.c_str(); }
}
