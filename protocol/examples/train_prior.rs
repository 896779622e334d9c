//! Trains the prior of the `context` coder: `train_prior SEED SCENES OUT`.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [seed, scenes, out] = arguments.as_slice() else {
        return Err("usage: train_prior SEED SCENES OUT".into());
    };
    let mut said = 0;
    let table = scenecast_protocol::map_codec::train_prior(seed.parse()?, scenes.parse()?, &mut |done| {
        if done >= said + 100 {
            said = done;
            eprintln!("{} %", done / 10);
        }
    });
    std::fs::write(out, &table)?;
    eprintln!("{} bytes", table.len());
    Ok(())
}
