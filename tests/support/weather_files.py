"""Weather files of invented years."""

import numpy as np

HEAD = """LOCATION,Nowhere,-,AUT,Invented,000000,{latitude},{longitude},{offset},{elevation}
DESIGN CONDITIONS,0
TYPICAL/EXTREME PERIODS,0
GROUND TEMPERATURES,0
HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0
COMMENTS 1,invented
COMMENTS 2,-
DATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31
"""
PLACE = {"latitude": 48.2, "longitude": 16.37, "offset": 1.0, "elevation": 200.0}
HOURS = np.arange(np.datetime64("2001-01-01T00"), np.datetime64("2002-01-01T00"))


def make_values(overall=0.0, beam=0.0, diffuse=0.0):
    """Return the irradiance of every hour, (8760, 3): constants or arrays."""
    return np.stack([np.broadcast_to(one, 8760) for one in (overall, beam, diffuse)], 1)


def _split(hour):
    year, month, rest = str(hour).split("-")
    day, clock = rest.split("T")
    return int(year), int(month), int(day), int(clock)


def save_epw(path, values, hours=HOURS, **place):
    """Write an EPW of hours, each with global, direct normal and diffuse irradiance."""
    lines = [HEAD.format(**{**PLACE, **place})]
    for hour, (overall, beam, diffuse) in zip(hours, values, strict=True):
        year, month, day, clock = _split(hour)
        words = [year, month, day, clock + 1, 60, "?9", 9, 5, 70, 101000, 0, 0, 300]
        lines.append(",".join(map(str, [*words, overall, beam, diffuse, 0, 0, 0, 0])) + "\n")
    path.write_text("".join(lines), encoding="utf-8")
    return path


def save_tmy3(path, values, hours=HOURS, **place):
    """Write a TMY3 of hours."""
    place = {**PLACE, **place}
    numbers = [place[name] for name in ("offset", "latitude", "longitude", "elevation")]
    lines = [f'000000,"NOWHERE",XX,{",".join(map(str, numbers))}\n']
    lines.append("Date (MM/DD/YYYY),Time (HH:MM),ETR (W/m^2),GHI (W/m^2),DNI (W/m^2),DHI (W/m^2)\n")
    for hour, (overall, beam, diffuse) in zip(hours, values, strict=True):
        year, month, day, clock = _split(hour)
        when = f"{month:02}/{day:02}/{year},{clock + 1:02}:00"
        lines.append(f"{when},0,{overall},{beam},{diffuse}\n")
    path.write_text("".join(lines), encoding="utf-8")
    return path


def save_pvgis(path, values, hours=HOURS, late=0.5, **place):
    """Write PVGIS' typical year, of values some hours later than the times say."""
    place = {**PLACE, **place}
    head = (
        f"Latitude (decimal degrees): {place['latitude']}\n"
        f"Longitude (decimal degrees): {place['longitude']}\n"
        f"Elevation (m): {place['elevation']}\n"
        f"Irradiance Time Offset (h): {late}\n"
        "month,year\n1,2007\n\n"
        "time(UTC),T2m,RH,G(h),Gb(n),Gd(h),IR(h),WS10m,WD10m,SP\n"
    )
    lines = [head]
    for hour, (overall, beam, diffuse) in zip(hours, values, strict=True):
        year, month, day, clock = _split(hour)
        when = f"{year}{month:02}{day:02}:{clock:02}00"
        lines.append(f"{when},9.0,70.0,{overall},{beam},{diffuse},300.0,1.0,90.0,99000\n")
    lines.append("\nT2m: 2-m air temperature (degree Celsius)\n")
    path.write_text("".join(lines), encoding="utf-8")
    return path
