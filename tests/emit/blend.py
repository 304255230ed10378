metadata = {"protocolName": "blend"}
requirements = {"robotType": "OT-2", "apiLevel": "2.19"}


def run(protocol):
    liquid_1 = protocol.define_liquid(name="water", description="water", display_color=None)
    liquid_2 = protocol.define_liquid(name="water + acid", description="water + acid", display_color=None)
    ot2_left = protocol.load_instrument("p300_multi_gen2", "left")
    ot2_right = protocol.load_instrument("p20_single_gen2", "right")
    tips = protocol.load_labware("opentrons_96_tiprack_300ul", "8", label="tips", namespace="opentrons", version=1)
    small = protocol.load_labware("opentrons_96_tiprack_20ul", "9", label="small", namespace="opentrons", version=1)
    shaker = protocol.load_module("heaterShakerModuleV1", "1")
    shaker.open_labware_latch()
    plate = shaker.load_labware("corning_96_wellplate_360ul_flat", label="plate", namespace="opentrons", version=2)
    stock = protocol.load_labware("nest_12_reservoir_15ml", "5", label="stock", namespace="opentrons", version=1)
    stock["A1"].load_liquid(liquid_1, 10000)
    stock["A2"].load_liquid(liquid_2, 4999.913409132)
    # blend.mtx:19: close latch shaker
    shaker.close_labware_latch()
    # blend.mtx:20: note "with care"
    protocol.comment("with care")
    # blend.mtx:21: transfer 90 uL from stock[A1] to plate.column(1) by ot2.left using tips { tips: once, mix_after: 1, mix_volume: 40 uL }
    ot2_left.pick_up_tip(tips["A1"])
    ot2_left.flow_rate.aspirate = 94
    ot2_left.aspirate(90, stock["A1"].bottom(1))
    ot2_left.flow_rate.dispense = 94
    ot2_left.dispense(90, plate["A1"].top(0))
    ot2_left.aspirate(40, plate["A1"].bottom(1))
    ot2_left.dispense(40, plate["A1"].top(-9.67))
    ot2_left.drop_tip(protocol.fixed_trash)
    # blend.mtx:22: pick up tip small[A3] by ot2.right
    ot2_right.pick_up_tip(small["A3"])
    # blend.mtx:23: aspirate 17.5 uL from stock[A2] by ot2.right
    ot2_right.flow_rate.aspirate = 7.56
    ot2_right.aspirate(17.5, stock["A2"].bottom(1))
    # blend.mtx:24: for well in [plate[B1], plate[B2]] { dispense 1.25 uL into well by ot2.right }
    ot2_right.flow_rate.dispense = 7.56
    ot2_right.dispense(1.25, plate["B1"].top(0))
    ot2_right.dispense(1.25, plate["B2"].top(0))
    # blend.mtx:25: blow out into stock[A2] by ot2.right
    ot2_right.flow_rate.blow_out = 7.56
    ot2_right.blow_out(stock["A2"].top(0))
    # blend.mtx:26: return tip to small[A3] by ot2.right
    ot2_right.drop_tip(small["A3"])
    # blend.mtx:27: heat shaker to 40 degC
    shaker.set_target_temperature(40)
    # blend.mtx:28: shake shaker at 500 rpm
    shaker.set_and_wait_for_shake_speed(500)
    # blend.mtx:29: wait 90 s
    protocol.delay(seconds=90)
    # blend.mtx:30: stop shaking shaker
    shaker.deactivate_shaker()
    # blend.mtx:31: ask "is {plate} \"mixed\"?"
    protocol.pause("is plate \"mixed\"?")
    # blend.mtx:32: } finally { stop heating shaker }
    shaker.deactivate_heater()
