"""Files of motion to samples in ICRF axes: CCSDS OEM and AEM, two-line elements, tables."""
