//! What the service says and does of `expansion`; what it keeps is in [`super::super::expansion`].

use super::super::call::{Answer, Ask, done, say};
use super::super::controller::Controller;
use super::super::error::Refused;
use crate::kortex::messages::common::DeviceType;
use crate::kortex::messages::interconnect::{
    BridgeConfig, BridgeIdentifier, BridgeList, BridgeResult, BridgeStatus, EthernetConfiguration,
    GpioConfiguration, GpioIdentification, GpioState, I2cConfiguration, PortIdentification,
    UartConfiguration, UartDeviceIdentification,
};
use crate::kortex::rpc::{base, interconnect_config as call};

impl Controller {
    pub(in crate::emulator) fn interconnect_service(&mut self, ask: &Ask<'_>) -> Answer {
        self.config.must_be(ask.device, DeviceType::Interconnect)?;
        let wrist = &mut self.expansion;
        match ask.rpc {
            call::GET_UART_CONFIGURATION => {
                let asked: UartDeviceIdentification = ask.read()?;
                say(&UartConfiguration { port_id: asked.port_id, ..wrist.uart.clone() })
            }
            call::SET_UART_CONFIGURATION => {
                wrist.uart = ask.read()?;
                done()
            }
            call::GET_ETHERNET_CONFIGURATION => {
                let asked: PortIdentification = ask.read()?;
                say(&EthernetConfiguration { device: asked.device, ..wrist.ethernet.clone() })
            }
            call::SET_ETHERNET_CONFIGURATION => {
                wrist.ethernet = ask.read()?;
                done()
            }
            call::GET_GPIO_CONFIGURATION => {
                let GpioIdentification { identifier } = ask.read()?;
                let kept = wrist.pins.get(&identifier).map(|(config, _)| config.clone());
                say(&GpioConfiguration { identifier, ..kept.unwrap_or_default() })
            }
            call::SET_GPIO_CONFIGURATION => {
                wrist.configure_pin(ask.read()?)?;
                done()
            }
            call::GET_GPIO_STATE => {
                let GpioIdentification { identifier } = ask.read()?;
                say(&GpioState { identifier, value: wrist.pin(identifier)? })
            }
            call::SET_GPIO_STATE => {
                wrist.set_pin(&ask.read()?)?;
                done()
            }
            call::GET_I2C_CONFIGURATION => {
                let asked: PortIdentification = ask.read()?;
                say(&I2cConfiguration { device: asked.device, ..wrist.i2c.clone() })
            }
            call::SET_I2C_CONFIGURATION => {
                wrist.i2c = ask.read()?;
                done()
            }
            call::I2C_READ => say(&wrist.read(&ask.read()?, false)?),
            call::I2C_READ_REGISTER => say(&wrist.read(&ask.read()?, true)?),
            call::I2C_WRITE => {
                wrist.write(ask.read()?, false)?;
                done()
            }
            call::I2C_WRITE_REGISTER => {
                wrist.write(ask.read()?, true)?;
                done()
            }
            _ => Err(Refused::NotEmulated),
        }
    }

    /// The calls about bridges; `None` for any other.
    pub(in crate::emulator) fn bridge_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        let result = |bridge_id, status: BridgeStatus| {
            say(&BridgeResult { bridge_id, status: status as i32 })
        };
        Some(match ask.rpc {
            base::ENABLE_BRIDGE => ask.read().and_then(|asked: BridgeConfig| {
                let device = u8::try_from(asked.device_identifier).unwrap_or(u8::MAX);
                if self.config.must_be(device, DeviceType::Interconnect).is_err() {
                    return result(None, BridgeStatus::UnknownDevice);
                }
                let status = self.expansion.enable(&asked);
                let made = self.expansion.bridges.last().filter(|_| status == BridgeStatus::Ok);
                result(made.and_then(|made| made.bridge_id.clone()), status)
            }),
            base::DISABLE_BRIDGE => ask.read().and_then(|asked: BridgeIdentifier| {
                let status = self.expansion.disable(&asked);
                result(Some(asked), status)
            }),
            base::GET_BRIDGE_LIST => {
                say(&BridgeList { bridge_config: self.expansion.bridges.clone() })
            }
            base::GET_BRIDGE_CONFIG => ask.read().and_then(|asked: BridgeIdentifier| {
                let bridges = &self.expansion.bridges;
                let found = bridges.iter().find(|one| one.bridge_id.as_ref() == Some(&asked));
                say(found.ok_or(Refused::NoBridge)?)
            }),
            _ => return None,
        })
    }
}
