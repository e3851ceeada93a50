// gs_pixel_resolver: turns a tile's pixel buffers into pixels over the background, row by row, four a cycle.
//
//   one beat a cycle; the first leaves 7 cycles behind resolve_start; px_ready is cut by a skid buffer
//
//   R0 address   word of the unit that holds the subtile column
//   R1 read      pixel buffer
//   R2 select    unit, half of the word, fresh where the subtile was never loaded
//   R3 cover     T * background -> UQ3.ACC_F              half_up, cannot overflow
//   R4 add       acc + T * background                     exact
//   R5 narrow    value * 255 -> 8 bit                     half_up, sat
//
//   Beats: live rows x ceil(live columns / 4); pixels outside the picture have their strobes low.

`default_nettype none
`include "gs_params.vh"

module gs_pixel_resolver #(
    parameter UNITS    = `GS_UNITS,
    parameter GROUPS   = `GS_GROUPS,
    parameter LANES    = `GS_LANES,
    parameter TILE     = `GS_TILE,
    parameter T_F      = `GS_T_F,
    parameter ACC_F    = `GS_ACC_F,
    parameter ACC_W    = `GS_ACC_W,
    parameter COLOUR_F = `GS_COLOUR_F,
    parameter COLOUR_W = `GS_COLOUR_W,
    parameter PIXEL_W  = 13  // bits of a pixel coordinate
) (
    input  wire                                   clk,
    input  wire                                   rst,
    input  wire [PIXEL_W-1:0]                     cfg_width,     // of the picture, pixels
    input  wire [PIXEL_W-1:0]                     cfg_height,
    input  wire [COLOUR_W-1:0]                    cfg_bg_red,    // UQ3.COLOUR_F
    input  wire [COLOUR_W-1:0]                    cfg_bg_green,
    input  wire [COLOUR_W-1:0]                    cfg_bg_blue,

    // resolve: as gs_subtile_blender gives it
    input  wire                                   resolve_start,
    input  wire [PIXEL_W-1:0]                     resolve_x,
    input  wire [PIXEL_W-1:0]                     resolve_y,
    output wire                                   resolve_done,
    output wire                                   pixel_en,
    output wire [$clog2(GROUPS)+1:0]              pixel_addr,
    input  wire [UNITS*LANES*(T_F+3*ACC_W)-1:0] pixel_words,
    input  wire [UNITS*GROUPS-1:0]                touched,

    // px: 4 pixels RGBX, pixel 0 and its red lowest, X = 255; rgb: the same before R5, UQ3.ACC_F
    output wire                                   px_valid,
    input  wire                                   px_ready,
    output wire [127:0]                           px_data,
    output wire [15:0]                            px_strb,
    output wire                                   px_last,
    output wire [12*ACC_W-1:0]                    px_rgb
);

    localparam STATE_W = T_F + 3*ACC_W;
    localparam WORD_W  = LANES*STATE_W;
    localparam HALF_W  = 4*STATE_W;
    localparam AT_W    = $clog2(TILE);
    localparam QUAD_W  = AT_W - 2;
    localparam DROP    = T_F + COLOUR_F - ACC_F;
    localparam FULL_W  = ACC_W + DROP;
    localparam WIDE_W  = ACC_W + 8;
    localparam [ACC_W-1:0] NOTHING = {ACC_W{1'b0}};

    generate
        if (UNITS != 4 || TILE != 64 || LANES != 16) begin : g_rule
            UNITS_must_be_4_and_TILE_64_and_LANES_16 bad ();
        end
    endgenerate

    // Last row and column of the tile inside the picture
    function [AT_W-1:0] last_live;
        input [PIXEL_W-1:0] rest;
        begin
            last_live = (|rest[PIXEL_W-1:AT_W]) ? {AT_W{1'b1}} : rest[AT_W-1:0] - {{AT_W-1{1'b0}}, 1'b1};
        end
    endfunction

    // R0 address
    wire              move;   // all stages move together
    reg               run;
    reg  [AT_W-1:0]   row;
    reg  [QUAD_W-1:0] quad;
    reg  [AT_W-1:0]   last_row;
    reg  [AT_W-1:0]   last_column;
    wire              row_end  = quad == last_column[AT_W-1:2];
    wire              tile_end = row_end && row == last_row;
    wire [3:0]        tail     = {last_column[1:0] == 2'd3, last_column[1], last_column[1:0] != 2'd0, 1'b1};
    assign pixel_en   = run && move;
    assign pixel_addr = {row[AT_W-1:3], quad[QUAD_W-1], row[2:1]};
    always @(posedge clk) begin
        if (resolve_start) begin
            run         <= 1'b1;
            row         <= {AT_W{1'b0}};
            quad        <= {QUAD_W{1'b0}};
            last_row    <= last_live(cfg_height - resolve_y);
            last_column <= last_live(cfg_width - resolve_x);
        end
        if (run && move) begin
            quad <= row_end ? {QUAD_W{1'b0}} : quad + {{QUAD_W-1{1'b0}}, 1'b1};
            if (row_end) row <= row + {{AT_W-1{1'b0}}, 1'b1};
            if (tile_end) run <= 1'b0;
        end
        if (rst) run <= 1'b0;
    end

    // R1 read. Marks of a beat: {last, pixels inside}
    reg        r1_valid;
    reg  [4:0] r1_marks;
    reg  [1:0] r1_unit;
    reg  [1:0] r1_half;
    reg        r1_touched;
    always @(posedge clk) begin
        if (move) r1_valid   <= run;
        if (move) r1_marks   <= {tile_end, row_end ? tail : 4'b1111};
        if (move) r1_unit    <= quad[2:1];
        if (move) r1_half    <= {row[0], quad[0]};
        if (move) r1_touched <= touched[{quad[2:1], pixel_addr[5:2]}];
        if (rst) r1_valid <= 1'b0;
    end
    assign resolve_done = move && r1_valid && r1_marks[4];

    // R2 select
    wire [WORD_W-1:0] r1_word = pixel_words[r1_unit*WORD_W +: WORD_W];
    reg               r2_valid;
    reg  [4:0]        r2_marks;
    reg  [HALF_W-1:0] r2_states;
    reg               r3_valid;
    reg  [4:0]        r3_marks;
    reg               r4_valid;
    reg  [4:0]        r4_marks;
    reg               r5_valid;
    reg  [4:0]        r5_marks;
    always @(posedge clk) begin
        if (move) begin
            r2_valid  <= r1_valid;
            r2_marks  <= r1_marks;
            r2_states <= r1_touched ? r1_word[r1_half*HALF_W +: HALF_W] : {4{{3{NOTHING}}, {T_F{1'b1}}}};
            r3_valid  <= r2_valid;
            r3_marks  <= r2_marks;
            r4_valid  <= r3_valid;
            r4_marks  <= r3_marks;
            r5_valid  <= r4_valid;
            r5_marks  <= r4_marks;
        end
        if (rst) begin
            r2_valid <= 1'b0;
            r3_valid <= 1'b0;
            r4_valid <= 1'b0;
            r5_valid <= 1'b0;
        end
    end

    wire [3*COLOUR_W-1:0]  background = {cfg_bg_blue, cfg_bg_green, cfg_bg_red};
    wire [4*3*ACC_W-1:0]   r5_rgb;
    wire [127:0]           r5_data;
    wire [15:0]            r5_strb;
    genvar p;
    genvar k;
    generate
        for (p = 0; p < 4; p = p + 1) begin : g_pixel
            wire [STATE_W-1:0] r2_state = r2_states[p*STATE_W +: STATE_W];
            wire [T_F-1:0]     r2_t     = r2_state[T_F-1:0];  // T - 1, UQ0.T_F
            for (k = 0; k < 3; k = k + 1) begin : g_colour
                wire [FULL_W-1:0] r2_colour = {{FULL_W-COLOUR_W{1'b0}}, background[k*COLOUR_W +: COLOUR_W]};
                wire [FULL_W-1:0] r2_full   = {{FULL_W-T_F{1'b0}}, r2_t} * r2_colour + r2_colour
                                            + {{ACC_W{1'b0}}, 1'b1, {DROP-1{1'b0}}};
                wire [WIDE_W-1:0] r4_wide;
                reg  [ACC_W-1:0]  r3_cover;  // UQ3.ACC_F
                reg  [ACC_W-1:0]  r3_acc;    // UQ3.ACC_F
                reg  [ACC_W-1:0]  r4_value;  // UQ3.ACC_F
                reg  [ACC_W-1:0]  r5_value;  // UQ3.ACC_F
                reg  [7:0]        r5_byte;
                assign r4_wide = {r4_value, 8'd0} - {8'd0, r4_value} + {{WIDE_W-ACC_F{1'b0}}, 1'b1, {ACC_F-1{1'b0}}};
                always @(posedge clk) if (move) begin
                    r3_cover <= r2_full[FULL_W-1:DROP];
                    r3_acc   <= r2_state[T_F + k*ACC_W +: ACC_W];
                    r4_value <= r3_acc + r3_cover;
                    r5_value <= r4_value;
                    r5_byte  <= r4_wide[ACC_F +: 8] | {8{|r4_wide[WIDE_W-1:ACC_F+8]}};
                end
                assign r5_rgb[(p*3 + k)*ACC_W +: ACC_W] = r5_value;
                assign r5_data[p*32 + k*8 +: 8]         = r5_byte;
                wire unused_colour_ok = &{1'b0, r2_full[DROP-1:0], r4_wide[ACC_F-1:0]};
            end
            assign r5_data[p*32 + 24 +: 8] = 8'd255;
            assign r5_strb[p*4 +: 4]       = {4{r5_marks[p]}};
        end
    endgenerate

    gs_skid #(.WIDTH(1 + 16 + 128 + 12*ACC_W)) px_skid (
        .clk(clk), .rst(rst),
        .in_valid(r5_valid), .in_ready(move), .in_data({r5_marks[4], r5_strb, r5_data, r5_rgb}),
        .out_valid(px_valid), .out_ready(px_ready), .out_data({px_last, px_strb, px_data, px_rgb})
    );

endmodule

`default_nettype wire
